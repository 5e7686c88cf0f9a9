"""What a diagnosis says it rests on, and where it sends its reader: rivals are told apart before one of them is added."""

from __future__ import annotations

from pathlib import Path

import pytest

from fieldsid.cli.headlines.missing import Searched, of_diagnosis, of_extension

SEARCHED = Searched((Path("a.csv"), Path("b.csv")), (Path("c.csv"),), Path("m.yaml"), thorough=False)


def body(verdict: str, *, file: str = "") -> dict[str, object]:
    """A diagnosis as `--json` has it, as far as its headline reads it."""
    return {
        "verdict": verdict,
        "axis": "yaw",
        "says": "servo_lag or delay",
        "short": "servo_lag or delay",
        "applied": [],
        "effects": ["servo_lag"],
        "candidates": [
            {"effect": "servo_lag", "probability": 0.6, "log_evidence": 44.0},
            {"effect": "delay", "probability": 0.4, "log_evidence": 30.0},
        ],
        "runs": ["a", "b"],
        "validation_runs": ["c"],
        "next_maneuver": {"command": "sysid plan --separate servo_lag,delay"},
        "file": file,
        "known": [],
        "figure": None,
        "notes": [],
    }


@pytest.mark.parametrize(
    ("file", "says"),
    [("", "sysid plan --separate servo_lag,delay --axis yaw -o plan"), ("d.yaml", "sysid plan --from d.yaml -o plan")],
)
def test_rivals_are_told_apart_first(file, says):
    assert of_diagnosis(body("undecided", file=file), SEARCHED).next == says


def test_the_first_line_says_how_far_the_next_best_is_behind():
    assert of_diagnosis(body("effect"), SEARCHED).says == "effect: servo_lag or delay; next best: delay, 14 nats behind"


def test_what_was_added_already_is_used():
    added = body("effect") | {"applied": [{"model": "models/m+servo_lag.yaml"}]}
    assert of_diagnosis(added, SEARCHED).next == "sysid turn-radius models/m+servo_lag.yaml"


def test_an_effect_that_is_named_is_added():
    assert of_diagnosis(body("effect"), SEARCHED).next == "sysid extend m.yaml a.csv b.csv --add servo_lag --validate c.csv"


@pytest.mark.parametrize(
    ("runs", "codes", "says"),
    [
        (["a", "b", "c"], [], "3 runs (a, b, c), one of them held back to judge by;"),
        (["a", "b"], [], "2 runs (a, b), the last part of each held back to judge by;"),
        (["a"], ["nothing_held_back"], "1 run fitted to (a), judged by the same: too short to hold a part back;"),
    ],
)
def test_it_says_what_judged_where_no_run_was_given_for_it(runs, codes, says):
    alone = body("effect") | {"runs": runs, "validation_runs": [], "notes": [{"code": code} for code in codes]}
    assert of_diagnosis(alone, SEARCHED).rests_on.startswith(says)


def test_an_extension_of_a_log_without_noise_is_told_in_units_as_its_diagnosis_was():
    errors = {
        w: {"validation": {"angle_rms_rad": a, "rate_rms_rad_s": r}}
        for w, a, r in (("before", 0.11, 0.0051), ("after", 0.026, 0.0033))
    }
    extended = errors | {
        "over_floor": {"before": 25650.0, "after": 6100.0}, "pays": True, "kept": True, "unseen": True, "added": ["current"],
        "learned_on": ["a", "b"], "judged_on": ["c"], "next": "",
    }  # fmt: skip
    told = "current kept: the error on unseen data goes from 0.11 rad and 0.0051 rad/s to 0.026 rad and 0.0033 rad/s"
    assert of_extension(extended).says == told
    noisy = extended | {"over_floor": {"before": 3.2, "after": 1.04}}
    assert of_extension(noisy).says.endswith("goes from 3.20 to 1.04 x the noise floor")
