"""What a diagnosis says it rests on, and where it sends its reader: rivals are told apart before one of them is added."""

from __future__ import annotations

from dataclasses import replace
from math import nan
from pathlib import Path

import pytest

from fieldsid.cli.headlines.missing import Searched, headline_of_diagnosis, headline_of_extension
from fieldsid.diagnosis.records import Candidate, Diagnosis, Errors, NextManeuver, Pair
from fieldsid.extension.extend import Extension, Gain
from fieldsid.extension.lineage import Parent
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.results.diagnoses import Applied, Diagnosed
from fieldsid.results.extensions import Extended, LeftOver

SEARCHED = Searched((Path("a.csv"), Path("b.csv")), (Path("c.csv"),), Path("m.yaml"), thorough=False)


def told(verdict: str, **more: object) -> Diagnosed:
    """What a diagnosis comes to, as far as its headline reads it."""
    nothing, noise = Pair(Errors(nan, nan), Errors(nan, nan)), Noise(0.01, 0.01)
    candidates = tuple(
        Candidate((name,), probability, {}, nothing, 0.0, score, "")
        for name, probability, score in (("servo_lag", 0.6, 44.0), ("delay", 0.4, 30.0))
    )
    found = Diagnosis(
        Axis.YAW, verdict, ("servo_lag",), "servo_lag or delay", "servo_lag or delay", nothing, nothing, noise, candidates,
        None, None, next_maneuver=NextManeuver("zigzag", "it shows", command="sysid plan --separate servo_lag,delay"),
        notes=tuple(Note(code, "") for code in more.pop("codes", ())),
    )  # fmt: skip
    given = {"runs": ("a", "b"), "validation_runs": ("c",), "model": None, "known": (), "skipped_runs": ()} | more
    return Diagnosed(found=found, **given)


@pytest.mark.parametrize(
    ("file", "says"),
    [("", "sysid plan --separate servo_lag,delay --axis yaw -o plan"), ("d.yaml", "sysid plan --from d.yaml -o plan")],
)
def test_rivals_are_told_apart_first(file, says):
    assert headline_of_diagnosis(told("undecided", file=file), SEARCHED).next == says


def test_the_first_line_says_how_far_the_next_best_is_behind():
    assert headline_of_diagnosis(told("effect"), SEARCHED).says == "effect: servo_lag or delay; next best: delay, 14 nats behind"


def test_what_was_added_already_is_used():
    added = Applied(None, "servo_lag", "models/m+servo_lag.yaml", pays=True)
    assert headline_of_diagnosis(told("effect", applied=(added,)), SEARCHED).next == "sysid turn-radius models/m+servo_lag.yaml"


def test_an_effect_that_is_named_is_added():
    assert (
        headline_of_diagnosis(told("effect"), SEARCHED).next == "sysid extend m.yaml a.csv b.csv --add servo_lag --validate c.csv"
    )


@pytest.mark.parametrize(
    ("runs", "codes", "says"),
    [
        (["a", "b", "c"], [], "3 runs (a, b, c), one of them held back to judge by;"),
        (["a", "b"], [], "2 runs (a, b), the last part of each held back to judge by;"),
        (["a"], [], "1 run (a), its last part held back to judge by;"),
        (["a"], ["nothing_held_back"], "1 run fitted to (a), judged by the same: too short to hold a part back;"),
    ],
)
def test_it_says_what_judged_where_no_run_was_given_for_it(runs, codes, says):
    alone = told("effect", runs=tuple(runs), validation_runs=(), codes=codes)
    assert headline_of_diagnosis(alone, SEARCHED).rests_on.startswith(says)


def test_an_extension_of_a_log_without_noise_is_told_in_units_as_its_diagnosis_was():
    none = Errors(nan, nan)
    before, after = (Pair(none, Errors(angle, rate)) for angle, rate in ((0.11, 0.0051), (0.026, 0.0033)))
    quiet = Gain(("current",), before, after, Noise(0.11 / 25650.0, 0.0051 / 25650.0), True, ("a", "b"), ("c",))
    left = "current kept: the error on unseen data goes from 0.11 rad and 0.0051 rad/s to 0.026 rad and 0.0033 rad/s"
    assert headline_of_extension(extended(quiet)).says == left
    noisy = replace(quiet, noise_floor=Noise(0.11 / 3.2, 0.0051 / 3.2))
    assert headline_of_extension(extended(noisy)).says.endswith("goes from 3.20 to 1.56 x the noise floor")


@pytest.mark.parametrize(
    ("judged_on", "unseen", "says"),
    [(("c",), True, "c"), (("b", "a"), True, "what was held back of them"), (("a", "b"), False, "the same")],
)
def test_an_extension_says_what_judged_it_where_that_are_the_runs_it_was_fitted_to(judged_on, unseen, says):
    errors = Pair(Errors(0.02, 0.02), Errors(0.02, 0.02))
    gain = Gain(("current",), errors, errors, Noise(0.01, 0.01), unseen, ("a", "b"), judged_on)
    assert headline_of_extension(extended(gain)).rests_on == f"2 runs fitted to (a, b), judged by {says}"


def extended(gain: Gain) -> Extended:
    """What an extension that is kept comes to."""
    return Extended(
        found=Extension(None, gain, 9.0), kept=True, kept_by="unseen", model="", effects=gain.added,
        parent=Parent(Path("m.yaml"), "", "intact"), skipped_runs=(), next="", left=LeftOver(1.0, 1.0, more_than_noise=False),
    )  # fmt: skip
