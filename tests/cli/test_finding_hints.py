"""What a finding of the import doctor says is pasted: a line into the mapping, an option behind the command; then it is gone."""

from __future__ import annotations

import re

import numpy as np
import pytest
from faults.damages import DAMAGES, good_log, is_told

from fieldsid.artifacts import to_yaml
from fieldsid.logs.run import EXPLAINING

LINE = re.compile(r"`(\w+): ([^`]+)`(?: at ((?:\w+ (?:or|and) )*\w+))?")
OPTIONS = re.compile(r"`(--(?:from|to) [^`]+)`")
TOLD_IN_WORDS = {"spikes", "disagree", "dropouts", "repeated", "coarse", "constant", "missing", "jitter", "swapped", "unrelated",
                 "clock_offset", "fin_late", "course_slope", "course_offset", "rate_scale", "wrap_interpolated"}  # fmt: skip
"""Findings whose remedy is no line and no option: a sensor, a logger, or another column."""


def written(folder, damage, seed=50002):
    log = good_log(1000 + seed)
    damage.spoil(log, np.random.default_rng(seed))
    rows = [",".join("" if np.isnan(v) else f"{v:.6f}" for v in row) for row in zip(*log.values(), strict=True)]
    names = {s: f"column {i}" for i, s in enumerate(log)}
    (folder / "log.csv").write_text("\n".join([",".join(names.values()), *rows]) + "\n")
    body = {"time": {"column": names.pop("time_s"), "unit": "s"}, "signals": {s: {"column": c} for s, c in names.items()}}
    return folder / "log.csv", body


def imported(run_cli, folder, log, body, *options):
    (folder / "m.yaml").write_text(to_yaml(body))
    done = run_cli("import", log, "--mapping", folder / "m.yaml", "-o", folder / "runs", "--force", "--json", *options)
    assert done.code == 0, done.err
    return [n for run in done.json["runs"] for n in run["notes"] if n["code"] not in EXPLAINING]


def with_line(body, key, value, signals):
    """The mapping with a line set at some signals, or at the time."""
    number = float(value) if re.fullmatch(r"-?[\d.]+", value) else value
    number = int(number) if isinstance(number, float) and number.is_integer() else number
    changed = {s: {**item, key: number} if s in signals else item for s, item in body["signals"].items()}
    return {**body, "signals": changed} | ({"time": {**body["time"], key: number}} if "time" in signals else {})


def pasted(body, note):
    """Every mapping and every list of options that a finding's message says to take, one for each alternative."""
    lines = LINE.findall(note["message"])
    if "`unit: counts`" in note["message"]:  # one line of several parts
        for key, value, _ in lines:
            body = with_line(body, key, value, [note["data"]["signal"]])
        yield body, ()
        return
    for key, value, places in lines:
        default = note["data"].get("signal", "time")
        for place in (places or default).split(" or "):
            yield with_line(body, key, value, place.split(" and ")), ()
    for options in OPTIONS.findall(note["message"]):
        yield body, tuple(options.split())


@pytest.mark.parametrize("damage", [d for d in DAMAGES if d.told_by], ids=lambda d: d.name)
def test_a_damage_is_told_and_what_its_finding_says_to_set_can_be_pasted_and_ends_it(run_cli, tmp_path, damage):
    log, body = written(tmp_path, damage)
    notes = imported(run_cli, tmp_path, log, body)
    codes = {n["code"] for n in notes}
    assert is_told(damage, codes)
    for note in notes:
        ways = list(pasted(body, note))
        is_lost = note["code"] in ("unit", "speed_unit") and ("which one it is" in note["message"] or "time_unit" in codes)
        assert ways or note["code"] in TOLD_IN_WORDS or is_lost, note["message"]
        for changed, options in ways:
            left = imported(run_cli, tmp_path, log, changed, *options)
            same = [n for n in left if (n["code"], n["data"].get("signal")) == (note["code"], note["data"].get("signal"))]
            assert not [n for n in same if n["message"] == note["message"] or not options], (note["message"], changed, options)


BAD_LINES = {
    "a signal misspelt": {"yaw_rd": {"column": "a"}},
    "x in ENU alone": {"x_m": {"column": "a", "frame": "ENU"}},
    "a centre without counts": {"rudder_rad": {"column": "a", "centre": 128}},
    "a key misspelt": {"yaw_rad": {"colum": "a"}},
    "a unit misspelt": {"yaw_rad": {"column": "a", "unit": "degg"}},
    "a unit of something else": {"yaw_rad": {"column": "a", "unit": "kn"}},
    "a column misspelt": {"yaw_rad": {"column": "aa"}},
    "a field without a topic": {"yaw_rad": {"column": "a", "field": "x"}},
}


@pytest.mark.parametrize("case", BAD_LINES)
def test_what_an_error_of_a_mapping_says_makes_the_line_right(run_cli, tmp_path, case):
    (tmp_path / "log.csv").write_text("t,a\n" + "".join(f"{0.1 * i:.1f},{0.01 * i:.3f}\n" for i in range(60)))
    body = {"time": {"column": "t", "unit": "s"}, "signals": BAD_LINES[case]}
    (tmp_path / "m.yaml").write_text(to_yaml(body))
    refused = run_cli("import", tmp_path / "log.csv", "--mapping", tmp_path / "m.yaml", "-o", tmp_path / "runs")
    assert refused.code == 2
    hint = refused.err.split("hint: ")[1]
    (signal, item), (what, *_) = next(iter(BAD_LINES[case].items())), re.findall(r"`([^`]+)`", hint)
    if ": " in hint and (line := LINE.search(hint)):
        body["signals"] = {signal: {**item, line[1]: line[2]}}
    elif case == "a signal misspelt":
        body["signals"] = {what: item}
    elif case == "a key misspelt":
        body["signals"] = {signal: {what: "a"}}
    elif case == "a field without a topic":
        return  # a topic is none of a table's
    else:
        body["signals"] = {signal: {**item, ("column" if "column" in case else "unit"): what}}
    imported(run_cli, tmp_path, tmp_path / "log.csv", body)
