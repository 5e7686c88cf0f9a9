"""What every command prints with `--json` is what its schema in the guide declares: no key missing, none undeclared."""

from __future__ import annotations

import json
from runpy import run_path

import pytest
from guide.make import GUIDE
from guide.schema_pages import RESULTS, command_of, faults, file_of, required

SCHEMAS = {c: json.loads((GUIDE / "schemas" / file_of(c)).read_text()) for c in RESULTS}
RMS = {"angle_rms_rad", "rate_rms_rad_s"}
FIXED = {
    ("identify",): {"schema", "axis", "fits"},
    ("identify", "fits"): {
        "run", "model", "speed_m_s", "method", "effects", "parameters", "angle_fit_percent", "rate_fit_percent", "noise_floor",
        "warnings", *RMS,
    },
    ("identify", "fits", "parameters"): {"value", "std_error", "interval95", "unit"},
    ("identify", "fits", "noise_floor"): {"angle_rad", "rate_rad_s"},
    ("identify", "fits", "warnings"): {"code", "message"},
    ("compare",): {"schema", "runs"},
    ("compare", "runs"): {"run", "angle_fit_percent", "rate_fit_percent", "theil", "r2", "whiteness_p", "where", *RMS},
    ("compare", "runs", "where"): {"condition", "share_of_error", "rms_ratio", "t_start_s", "t_end_s"},
    ("diagnose",): {
        "schema", "axis", "verdict", "effects", "base", "final", "noise_floor", "where", "candidates", "next_maneuver",
    },
    ("diagnose", "base"): {"train", "validation"},
    ("diagnose", "base", "train"): RMS,
    ("diagnose", "final", "validation"): RMS,
    ("diagnose", "candidates"): {
        "effect", "probability", "parameters", "train", "validation", "explained", "evidence", "confusable_with",
    },
    ("extend",): {"schema", "before", "after", "noise_floor", "kept", "model"},
    ("fit",): {"schema"},
    ("turn-radius",): {"schema", "rows", "measured"},
    ("turn-radius", "rows"): {
        "speed_m_s", "side", "radius_m", "interval95", "steady_radius_m", "u_turn_radius_m", "u_turn_time_s",
        "yaw_rate_max_rad_s", "method", "extrapolated", "trust",
    },
    ("turn-radius", "measured"): {"run", "side", "radius_m", "interval95", "predicted_m"},
}  # fmt: skip
"""Keys that other programs rely on: they stay, whatever else joins them."""


@pytest.fixture(scope="module")
def bodies(guide_session):
    """Every JSON object that the guide's commands made, by line; a command that returns none is asked with `--json`."""
    asked = [
        "sysid init pandan2", "sysid inspect demo/trial/learn_1.4.csv", "sysid effects show servo_lag",
        "sysid effects new tow_drag -o demo/own/tow_drag.yaml",
        "sysid import demo/trial/*.csv --mapping demo/mapping.yaml -o demo/again",
    ]  # fmt: skip
    for line in asked:
        guide_session.body(line)
    return guide_session.bodies


@pytest.mark.parametrize("command", RESULTS)
def test_what_a_command_prints_is_what_its_schema_declares(command, bodies):
    of_it = {line: body for line, body in bodies.items() if command_of(body) == command}
    assert of_it, f"no line of the guide runs `sysid {command}`"
    assert {line: found for line, body in of_it.items() if (found := faults(body, SCHEMAS[command]))} == {}


@pytest.mark.parametrize("command", RESULTS)
def test_a_schema_leaves_no_key_out(command, bodies):
    of_it = {line: body for line, body in bodies.items() if command_of(body) == command}
    assert {line: found for line, body in of_it.items() if (found := faults(body, SCHEMAS[command], closed=True))} == {}


@pytest.mark.parametrize("place", FIXED, ids="/".join)
def test_the_keys_that_others_rely_on_are_always_there(place):
    assert FIXED[place] <= required(SCHEMAS[place[0]], *place[1:])


def test_the_verdicts_and_the_words_of_trust_are_those_that_others_rely_on():
    verdicts = SCHEMAS["diagnose"]["properties"]["verdict"]["enum"]
    assert set(verdicts) == {"effect", "sufficient", "disturbed", "unexplained", "undecided"}
    row = SCHEMAS["turn-radius"]["$defs"]["TurnRow"]["properties"]
    assert set(row["trust"]["enum"]) == {"measured", "identified", "extrapolated"}
    assert set(row["side"]["enum"]) == {"port", "starboard"}


def test_a_missing_key_and_a_wrong_type_are_seen(bodies):
    (body,) = (b for b in bodies.values() if command_of(b) == "history")
    assert "intact" in faults({k: v for k, v in body.items() if k != "intact"}, SCHEMAS["history"])[0]
    assert "$.intact" in faults({**body, "intact": "yes"}, SCHEMAS["history"])[0]
    assert faults({**body, "more": 1}, SCHEMAS["history"]) == []
    assert "more" in faults({**body, "more": 1}, SCHEMAS["history"], closed=True)[0]


@pytest.mark.field
def test_the_checker_beside_the_repository_asks_for_nothing_the_schemas_do_not_have():
    path = GUIDE.parents[2] / "shared" / "check_contract.py"
    if not path.is_file():
        pytest.skip(f"the checker is not part of the project and absent here: {path}")
    shapes = run_path(str(path))["SHAPES"]
    assert {c: lacking for c, shape in shapes.items() if (lacking := lacking_of(shape, SCHEMAS[c], SCHEMAS[c]))} == {}


def lacking_of(shape, schema, root, at="$"):
    """What the checker's shape (keys, one-element lists, sets of words, types) asks for and a schema does not promise."""
    here = followed(schema, root)
    if isinstance(shape, set):
        return [] if shape == set(here.get("enum", [])) else [f"{at}: {sorted(shape)}"]
    if isinstance(shape, list):
        return lacking_of(shape[0], here["items"], root, f"{at}[]")
    if not isinstance(shape, dict):
        return []
    inner = here.get("properties") or dict.fromkeys(shape, here.get("additionalProperties"))
    wanting = [f"{at}.{k}" for k in shape if k not in here.get("required", inner)]
    known = {k: s for k, s in shape.items() if isinstance(inner.get(k), dict)}
    return wanting + [f for k, s in known.items() for f in lacking_of(s, inner[k], root, f"{at}.{k}")]


def followed(schema, root):
    """The schema behind references and, of alternatives, the first one."""
    while "$ref" in schema or "anyOf" in schema:
        schema = schema["anyOf"][0] if "anyOf" in schema else root["$defs"][schema["$ref"].rpartition("/")[2]]
    return schema
