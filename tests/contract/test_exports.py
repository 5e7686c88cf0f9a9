"""Every export target: names, numbers, head of notes, and what its own reader gets back."""

from __future__ import annotations

import configparser
import re
import tempfile
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from fieldsid.errors import ArtifactError
from fieldsid.exports import all_targets
from fieldsid.exports._target import columns_of
from fieldsid.models.axis import Axis
from fieldsid.schedule.controller import Gains
from fieldsid.schedule.record import Row, Schedule, load_schedule, save_schedule

TARGETS = sorted(all_targets())


def schedule_of(axis=Axis.YAW, *, depth=False):
    rows = tuple(
        Row(
            1.0 + i,
            Gains(-1.0 / (1 + i), 0.0, -1e-7 * i),
            -0.013 * i,
            0.0,
            0.26,
            0.05 if depth else 0.0,
            i < 2,
            1.0,
            65.0,
            float("inf"),
            2.0,
            0.99,
            8.0,
        )
        for i in range(3)
    )
    provenance = {
        "models": [{"path": "models/a.yaml", "sha256": "0123456789abcdef" * 4}],
        "runs": ["r1", "r2"],
        "supported_m_s": [1.0, 2.0],
        "law": "rudder = kp e",
        "sign_convention": "positive rudder turns to port (b2 < 0)",
        "schedule_variable": "speed_m_s",
        "between_rows": "linear in speed",
        "outside_rows": "clamp",
    }
    return Schedule(axis, "p", 0.7, 45.0, depth, rows, {"lag_s": 0.2}, provenance)


@pytest.fixture(params=[(Axis.YAW, False), (Axis.PITCH, True)], ids=["heading", "depth"])
def schedule(request):
    return schedule_of(request.param[0], depth=request.param[1])


@pytest.mark.parametrize("name", TARGETS)
def test_a_target_says_what_it_is(name):
    target = all_targets()[name]
    assert target.name == name
    assert target.says
    assert target.suffix.startswith(".")


@pytest.mark.parametrize("name", TARGETS)
def test_the_text_carries_provenance_signs_margins_and_support(name, schedule):
    target = all_targets()[name]
    text = target.render(schedule, target.node, None)
    for word in ("0123456789ab", "r1, r2", "b2 < 0", "65 deg", "clamp", "1.00 to 2.00 m/s"):
        assert word in text, word


@pytest.mark.parametrize("name", sorted(set(TARGETS) - {"yaml", "px4"}))
def test_every_number_has_a_decimal_point_and_no_exponent(name, schedule):
    target = all_targets()[name]
    body = "\n".join(
        line for line in target.render(schedule, target.node, None).splitlines() if not line.lstrip().startswith(("#", "//"))
    )
    numbers = re.findall(r"(?<![\w.])-?\d[\w.+-]*", body)
    assert len(numbers) >= 3 * 7
    loose = [n for n in numbers if not re.fullmatch(r"-?\d+\.\d+", n)]
    assert set(loose) <= {"3", "10"}, loose  # the count of rows, a process' tick


@pytest.mark.parametrize("name", TARGETS)
def test_the_columns_come_back_from_the_text(name, schedule):
    target = all_targets()[name]
    found = READERS[name](target.render(schedule, target.node, None), target.node)
    for column, values in columns_of(schedule).items():
        assert found[column] == pytest.approx(values, abs=1e-6), column


FINS = {"names": ["fin1", "fin2"], "shares": [1.0, -1.0], "limits": [0.3, 0.26], "unit": "rad"}


TOLD_IN_WORDS = ("px4",)
"""Targets whose vehicle has its own allocation of fins: the file says in a comment what it has to be."""


@pytest.mark.parametrize("name", TARGETS)
def test_the_fins_that_make_the_command_come_back_with_their_limits(name):
    target, schedule = all_targets()[name], schedule_of()
    schedule = replace(schedule, provenance={**schedule.provenance, "fins": FINS})
    text = target.render(schedule, target.node, None)
    assert "fin2 = -1 rudder, within +/-0.26 rad" in text
    if name not in TOLD_IN_WORDS:
        assert FINS_OF[name](text, target.node) == [("fin1", 1.0, 0.3), ("fin2", -1.0, 0.26)]


def fins_of_yaml(text, node):
    found = YAML(typ="safe").load(text)[node]["fins"]
    return list(zip(found["names"], found["shares"], found["limits"], strict=True))


def fins_of_ros2(text, node):
    found = YAML(typ="safe").load(text)[node]["ros__parameters"]["heading_fins"]
    assert all(type(x) is float for key in ("shares", "limits") for x in found[key])
    return list(zip(found["names"], found["shares"], found["limits"], strict=True))


def fins_of_dune(text, node):
    parser = configparser.ConfigParser()
    parser.read_string(text)
    names, shares, limits = (parser[node][key].split(", ") for key in ("fins", "fin shares", "fin limits"))
    return list(zip(names, map(float, shares), map(float, limits), strict=True))


def fins_of_ardupilot(text, node):
    lines = dict(line.split(",") for line in text.splitlines() if line and not line.startswith("#"))
    assert all(len(name) <= 16 for name in lines)
    return [(f"fin{k}", float(lines[f"{node}_FIN{k}"]), float(lines[f"{node}_FIN{k}_MAX"])) for k in (1, 2)]


def fins_of_moos(text, node):
    rows = [
        dict(p.strip().split("=") for p in line.split("FIN = ")[1].split(",")) for line in text.splitlines() if "FIN = " in line
    ]
    return [(r["name"], float(r["share"]), float(r["limit"])) for r in rows]


FINS_OF = {
    "yaml": fins_of_yaml, "ros2": fins_of_ros2, "dune": fins_of_dune, "ardupilot": fins_of_ardupilot, "moos": fins_of_moos,
}  # fmt: skip


def read_yaml(text, node):
    rows = YAML(typ="safe").load(text)[node]["rows"]
    return {k: [float(r[k]) for r in rows] for k in rows[0] if isinstance(rows[0][k], (int, float))}


def read_ros2(text, node):
    """A parser as strict as rcl's: a node, ros__parameters, strings and arrays of one type; no lists of maps, no nulls."""
    tree = YAML(typ="safe").load(text)
    assert list(tree) == [node]
    assert list(tree[node]) == ["ros__parameters"]
    ((name, block),) = tree[node]["ros__parameters"].items()
    assert re.fullmatch(r"[a-z][a-z0-9_]*", name)
    arrays = {k: v for k, v in block.items() if isinstance(v, list)}
    assert all(isinstance(v, (str, list)) for v in block.values())
    assert all(type(x) is float for v in arrays.values() for x in v)
    assert len({len(v) for v in arrays.values()}) == 1
    return arrays


def read_dune(text, node):
    parser = configparser.ConfigParser()
    parser.optionxform = str
    parser.read_string(text)
    names = {
        "Speeds": "speed_m_s",
        "Proportional Gains": "kp",
        "Integral Gains": "ki",
        "Derivative Gains": "kd",
        "Feed Forward": "feed_forward_rad",
        "Reference Gains": "reference_gain",
        "Maximum Fin Angle": "fin_limit_rad",
        "Depth Gains": "depth_gain",
        "Supported": "supported",
    }
    return {names[k]: [float(v) for v in text.split(",")] for k, text in parser[node].items() if k in names}


def read_ardupilot(text, node):
    names = {
        "SPEED": "speed_m_s",
        "P": "kp",
        "I": "ki",
        "D": "kd",
        "FF": "feed_forward_rad",
        "REF": "reference_gain",
        "MAX": "fin_limit_rad",
        "DEPTH": "depth_gain",
        "OK": "supported",
    }
    lines = dict(line.split(",") for line in text.splitlines() if line and not line.startswith("#"))
    assert all(len(name) <= 16 for name in lines)
    count = int(lines[f"{node}_COUNT"])
    return {c: [float(lines[f"{node}{i + 1}_{n}"]) for i in range(count)] for n, c in names.items() if f"{node}1_{n}" in lines}


def read_moos(text, node):
    assert f"ProcessConfig = {node}\n{{" in text
    lines = [line.split("ROW = ")[1] for line in text.splitlines() if line.startswith("  ROW = ")]
    rows = [dict(p.strip().split("=") for p in line.split(",")) for line in lines]
    return {k: [float(r[k]) for r in rows] for k in rows[0]}


def read_px4(text, node):
    rows = [line.removeprefix("# row: ") for line in text.splitlines() if line.startswith("# row: ")]
    held = [dict(part.split(" = ") for part in row.split(", ")) for row in rows]
    columns = {k: [float(r[k]) for r in held] for k in held[0]}
    lines = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    assert [line[:2] + line[4:] for line in lines] == [["1", "1", "9"]] * 2
    gains = {name.removeprefix(f"{node}_"): float(value) for _, _, name, value, _ in lines}
    axis = {name.split("_")[0] for name in gains}.pop()
    assert axis in ("YAW", "PITCH")
    for name, column in (("P", "kp"), ("D", "kd")):
        assert gains[f"{axis}_{name}"] == pytest.approx(abs(columns[column][-1]) / columns["fin_limit_rad"][-1], abs=1e-5)
    return columns


READERS = {
    "px4": read_px4,
    "yaml": read_yaml,
    "ros2": read_ros2,
    "dune": read_dune,
    "ardupilot": read_ardupilot,
    "moos": read_moos,
}


def test_every_target_has_a_reader_here():
    assert set(TARGETS) == set(READERS)


@pytest.mark.parametrize("name", ["dune", "ardupilot", "moos"])
def test_a_template_of_ones_own_is_used_and_a_broken_one_refused(name, tmp_path):
    own = tmp_path / "own.txt"
    own.write_text("{{ node }} {{ rows[0].kp }}")
    assert all_targets()[name].render(schedule_of(), "N", own) == "N -1.0"
    for broken in ("{{ nothing }}", "{% for %}"):
        own.write_text(broken)
        with pytest.raises(ArtifactError, match="not valid"):
            all_targets()[name].render(schedule_of(), "N", own)


LINES = (
    "SERVO1_MIN,500",
    "fin_limit_rad: [9.0]",
    "Maximum Fin Angle = 9.0",
    "  ROW = fin_limit_rad=9.0",
    "[Control]",
    "}",
    "{{ 1 }}",
)
ENDS = ("\n", "\r", "\r\n", "\x0b", "\x0c", "\x1c", "\x85", "\u2028", "\u2029")
OWN_LINES = st.builds("{0}{1}{2}{1}# ".format, st.text(max_size=5), st.sampled_from(ENDS), st.sampled_from(LINES))
TEXT = st.one_of(st.text(max_size=20), OWN_LINES)
SAYS = ("tool", "law", "sign_convention", "schedule_variable", "between_rows", "outside_rows")


@st.composite
def accepted(draw):
    """A schedule of somebody else's that is read without complaint: numbers as they may be, any words wherever words may be."""
    axis, depth = draw(st.sampled_from([(Axis.YAW, False), (Axis.PITCH, True)]))
    known = schedule_of(axis, depth=depth)
    models = [{"path": draw(TEXT), "sha256": draw(TEXT)} for _ in range(draw(st.integers(0, 2)))]
    said = {name: draw(TEXT) for name in SAYS if draw(st.booleans())}
    provenance = {**known.provenance, **said, "models": models, "runs": draw(st.lists(TEXT, max_size=3)), draw(TEXT): draw(TEXT)}
    made = replace(known, kind=draw(st.sampled_from(["p", "pd", "pi", "pid", "lqr"])), provenance=provenance)
    with tempfile.TemporaryDirectory() as folder:
        return load_schedule(save_schedule(made, Path(folder) / "gains.yaml"))


@settings(max_examples=8)  # a YAML file each
@pytest.mark.parametrize("name", TARGETS)
@given(schedule=accepted())
def test_an_export_holds_exactly_its_own_keys_whatever_a_schedule_says(name, schedule):
    target = all_targets()[name]
    text, plain = (target.render(s, target.node, None) for s in (schedule, plainly(schedule)))
    columns = "\t" if name == "px4" else "\n"  # what that one separates by
    assert all(line.isprintable() for line in text.replace(columns, "\n").split("\n"))
    assert text.splitlines() == text.removesuffix("\n").split("\n")
    assert own_keys(name, text, target.node) == own_keys(name, plain, target.node)
    assert set(READERS[name](text, target.node)) >= set(columns_of(schedule))


def plainly(schedule):
    """The same schedule with no words but its own."""
    return replace(schedule, provenance=schedule_of(schedule.axis, depth=schedule.depth).provenance)


def own_keys(name, text, node):
    """All that a file says but comments, and of the plain YAML its keys, without the words of where it came from."""
    if name == "yaml":
        (inner,) = YAML(typ="safe").load(text).values()
        assert isinstance(inner.pop("provenance"), dict)
        return inner
    return [line for line in text.splitlines() if not line.startswith(("#", "//"))]


@pytest.mark.parametrize("kind", ['pd"\n      fin_limit_rad: [9.0]', "PD", "", None, 3, ["pd"], {"pd": 1}])
def test_a_schedule_with_a_controller_that_there_is_not_is_refused(tmp_path, kind):
    path = save_schedule(replace(schedule_of(), kind=kind), tmp_path / "gains.yaml")
    with pytest.raises(ArtifactError, match="not a complete schedule") as error:
        load_schedule(path)
    assert "not one of p, pd, pi, pid, lqr" in error.value.found


@pytest.mark.parametrize("reached", ["{{ ''.__class__.__mro__ }}", "{{ notes.append('x') }}", "{{ notes.__init__.__globals__ }}"])
def test_a_template_of_somebody_elses_reaches_no_python(tmp_path, reached):
    own = tmp_path / "own.txt"
    own.write_text(reached)
    with pytest.raises(ArtifactError, match="not valid"):
        all_targets()["dune"].render(schedule_of(), "N", own)


@pytest.mark.parametrize("mistake", ["{{ 1 / 0 }}", "{{ 'a' + 1 }}", "{{ '%d' | format('x') }}", "{{ range(10 ** 9) | list }}"])
def test_a_mistake_in_a_template_is_said(tmp_path, mistake):
    own = tmp_path / "own.txt"
    own.write_text(mistake)
    with pytest.raises(ArtifactError, match="not valid"):
        all_targets()["moos"].render(schedule_of(), "N", own)


@pytest.mark.parametrize("node", ["N", "/**", "**", "a b", "x: {y: 1}, z", "n\nm", '"'])
def test_the_name_of_a_node_is_one_key(node):
    assert list(YAML(typ="safe").load(all_targets()["ros2"].render(schedule_of(), node, None))) == [node]
