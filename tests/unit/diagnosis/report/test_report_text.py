"""The evidence in words, on hypotheses made by hand: what it says is what the table and the figure show."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fieldsid.diagnosis.diagnose import confusable
from fieldsid.diagnosis.evidence.scored_model import errors_of
from fieldsid.diagnosis.records import Errors, Left, Pair
from fieldsid.diagnosis.report.report_text import evidence, headline
from fieldsid.diagnosis.verdict import Verdict, excess_explained, probabilities, worsens
from fieldsid.fitting.predict.own_moment import FreeRun
from fieldsid.models.model import Noise

FLOOR = Noise(0.004, 0.002)
NOTHING_LEFT = Left(1.0, unexplained=False)


def _errors(*over: float) -> Errors:
    """Errors over the floor of some runs of the same length."""
    mean = float(np.sqrt(np.mean(np.square(over))))
    return Errors(FLOOR.angle * mean, FLOOR.rate * mean, tuple(Errors(FLOOR.angle * e, FLOOR.rate * e) for e in over))


def _made(*names: str, train: tuple[float, ...], unseen: tuple[float, ...], score: float):
    """One with errors over the floor of its fitted and unseen runs, and a log evidence."""
    pair = Pair(_errors(*train), _errors(*unseen))
    return SimpleNamespace(
        names=names,
        log_evidence=score,
        errors=pair,
        selection_errors=pair.validation,
    )


BASE = _made(train=(1.1,), unseen=(1.1,), score=0.0)


def _search(base=BASE, *, noiseless=False):
    return SimpleNamespace(base=lambda: base, validation=(None,), known=(), floor=FLOOR, is_noiseless=noiseless)


def test_what_raises_the_error_is_said_to_make_it_worse():
    h = _made("current", train=(1.0,), unseen=(3.3,), score=40.0)
    said = evidence(_search(), h, h.errors, FLOOR, h.log_evidence)
    assert said.startswith("makes it worse: error on unseen runs 1.10 -> 3.30 x noise floor; log evidence +40.0")
    assert "%" not in said
    assert worsens(_search(), h, FLOOR)


def test_what_lowers_it_says_the_share_of_the_table():
    h = _made("servo_lag", train=(1.0,), unseen=(1.02,), score=40.0)
    said = evidence(_search(), h, h.errors, FLOOR, h.log_evidence)
    assert f"1.10 -> 1.02 x noise floor ({100 * excess_explained(_search(), h, FLOOR):.0f} % of the excess)" in said
    assert not worsens(_search(), h, FLOOR)


def test_errors_of_logs_without_noise_are_said_in_their_units():
    h = _made("servo_lag", train=(1.0,), unseen=(1.02,), score=40.0)
    said = evidence(_search(noiseless=True), h, h.errors, FLOOR, h.log_evidence)
    assert "error on unseen runs 0.0044 rad and 0.0022 rad/s -> 0.0041 rad and 0.0020 rad/s (" in said
    assert "noise floor" not in said


def test_runs_are_counted_by_the_error_that_the_sentence_is_about():
    base = _made(train=(90.0,), unseen=(145.0,), score=0.0)
    h = _made("stall", train=(800.0,), unseen=(1922.0,), score=9.0)
    said = evidence(_search(base), h, h.errors, FLOOR, h.log_evidence)
    assert "145.00 -> 1922.00" in said
    assert said.endswith("error lower on 0 of 2 runs")


def test_what_is_alike_is_not_lower():
    base = _made(train=(2.0, 2.0), unseen=(2.0,), score=0.0)
    h = _made("stall", train=(1.99, 1.5), unseen=(1.0,), score=9.0)
    assert evidence(_search(base), h, h.errors, FLOOR, h.log_evidence).endswith("error lower on 2 of 3 runs")


@pytest.mark.parametrize(("behind", "rival"), [(0.5, True), (5.9, True), (6.1, False), (400.0, False)])
def test_a_rival_is_one_whose_probability_makes_it_one(behind, rival):
    base = _made(train=(3.0,), unseen=(3.0,), score=0.0)
    first = _made("servo_lag", train=(1.0,), unseen=(1.12,), score=500.0)
    other = _made("delay", train=(1.6,), unseen=(1.67,), score=500.0 - behind)
    shown = [first, other]
    p = probabilities({frozenset(h.names): h.log_evidence for h in shown})
    assert confusable(_search(base), first, shown, p, FLOOR) == (("delay",) if rival else ())
    assert confusable(_search(base), other, shown, p, FLOOR) == (("servo_lag",) if rival else ())


def test_errors_hold_those_of_each_run():
    records = [SimpleNamespace(ok=np.ones((2, n), dtype=bool)) for n in (10, 30)]
    records[0].ok[1] = False
    residuals = [np.full((2, 10), 0.1), np.full((2, 30), 0.3)]
    found = errors_of([FreeRun(r, e, np.zeros_like(e), np.ones((2, 1))) for r, e in zip(records, residuals, strict=True)], 1.0)
    assert [e.angle_rms_rad for e in found.each] == pytest.approx([0.1, 0.3])
    assert np.isnan(found.each[0].rate_rms_rad_s)
    assert found.angle_rms_rad == pytest.approx(np.sqrt((10 * 0.01 + 30 * 0.09) / 40))
    assert found.rate_rms_rad_s == pytest.approx(0.3)
    assert errors_of([], 0.0).each == ()


@pytest.mark.parametrize(
    ("fitted", "unseen", "settled", "said"),
    [
        ((3.0, 1.0), (7.0, 1.1), (6.0, 1.1), "the error on unseen runs falls from 7.00 to 1.10 x the noise floor"),
        (
            (3.0, 1.0),
            (2.82, 2.82),
            (2.56, 1.43),
            (
                "with the numbers of all runs together the error on unseen runs falls from 2.56 to 1.43 x the noise floor; "
                "with the fitted runs' own it goes from 2.82 to 2.82 x the noise floor"
            ),
        ),
        (
            (3.0, 1.0),
            (6.81, 5.42),
            (5.35, 1.03),
            (
                "with the numbers of all runs together the error on unseen runs falls from 5.35 to 1.03 x the noise floor; "
                "with the fitted runs' own it goes from 6.81 to 5.42 x the noise floor"
            ),
        ),
        (
            (3.0, 1.0),
            (1.03, 1.02),
            (1.03, 1.02),
            (
                "the error on the fitted runs goes from 3.00 to 1.00 x the noise floor, that on unseen runs from 1.03 to 1.02 x "
                "the noise floor"
            ),
        ),
    ],
    ids=["unseen", "settled", "open", "fitted"],
)
def test_the_headline_says_the_error_that_falls(fitted, unseen, settled, said):
    base, found = (
        _made(*n, train=(f,), unseen=(u,), score=0.0) for n, f, u in zip([(), ("stall",)], fitted, unseen, strict=True)
    )
    for h, all_runs in zip((base, found), settled, strict=True):
        h.train, h.unseen_errors, h.effects = h.errors.train, (h.selection_errors, _errors(all_runs)), ()
    search = _search(base)
    sentence = headline(search, Verdict("effect", ("stall",)), found, SimpleNamespace(p=0.0), NOTHING_LEFT, FLOOR, FLOOR)
    assert sentence.full.endswith(f"): {said}")
    assert sentence.short == f"stall: {said}"


def named(effects, left, *, noiseless=False, p=0.0, noise=FLOOR):
    base, found = (_made(*n, train=(f,), unseen=(f,), score=0.0) for n, f in (((), 11.5), (effects, 1.8)))
    for h in (base, found):
        h.train, h.unseen_errors, h.effects = h.errors.train, (h.selection_errors,), ()
    search = _search(base, noiseless=noiseless)
    return headline(search, Verdict("effect", effects), found, SimpleNamespace(p=p), left, FLOOR, noise)


def test_what_every_hull_has_is_told_apart_from_what_is_unusual():
    said = named(("gyro_bias", "sway_coupling", "servo_lag"), NOTHING_LEFT).short
    assert said == (
        "gyro_bias with the hull's own sway_coupling, servo_lag: "
        "the error on unseen runs falls from 11.50 to 1.80 x the noise floor"
    )
    assert named(("servo_lag",), NOTHING_LEFT).short.startswith("servo_lag: the error")


def test_what_is_left_is_said_with_its_place():
    left = Left(1.83, unexplained=True, run="train_1", start_s=12.0, end_s=14.0, moves_with="roll rate")
    for said in (named(("gyro_bias",), left).full, named(("gyro_bias",), left).short):
        assert said.endswith(
            "; 1.8 x is left that nothing in the catalogue explains: "
            "it is largest in train_1 at 12-14 s, and moves with roll rate"
        )


def test_what_is_left_is_said_to_be_a_disturbance_perhaps_where_no_test_excludes_one():
    left = Left(6.8, unexplained=True, run="train_2", start_s=10.0, end_s=12.0)
    noise = replace(FLOOR, disturbance=0.0004, disturbance_time=3.3)
    of_a_sea = "; the tests do not tell it from a disturbance moment of 0.0004 rad/s^2 with a time constant of 3.3 s"
    assert of_a_sea in named(("trim_drift",), left, p=0.4, noise=noise).short
    assert "disturbance" not in named(("trim_drift",), left, p=1e-4, noise=noise).short


def test_what_is_left_of_a_log_without_noise_is_said_too():
    left = Left(40.0, unexplained=True, run="train_1", start_s=12.0, end_s=14.0)
    assert named(("wave",), left, noiseless=True).short.endswith(
        "; an error is left that nothing in the catalogue explains: it is largest in train_1 at 12-14 s"
    )


def _disturbed(base, h, noise):
    return headline(_search(base), Verdict("disturbed", ()), h, SimpleNamespace(), NOTHING_LEFT, FLOOR, noise).full


def test_a_disturbance_beside_small_effects_does_not_say_that_none_is_there():
    base, small = _made(train=(2.0,), unseen=(1.93,), score=0.0), _made("servo_lag", train=(2.0,), unseen=(1.75,), score=9.0)
    noise = Noise(0.004, 0.002, disturbance=0.0065, disturbance_time=2.3)
    alone, beside = (_disturbed(base, h, noise) for h in (base, small))
    assert alone.startswith(
        "no effect of the catalogue is missing: what is left, 1.93 x the noise floor, is a disturbance moment"
    )
    assert beside.startswith("what is left, 1.93 x the noise floor, is for the most part a disturbance moment of 0.0065 rad/s^2")
    assert beside.endswith("; servo_lag may be there besides, and leaves 1.75 x the noise floor")


def unexplained(base, found, *others, p=1e-9, noise=FLOOR):
    """What is said where none of these models explains enough, and the tests give that p."""
    for h in (base, found, *others):
        h.train, h.validation, h.validation_errors = h.errors.train, (None,), h.errors.validation
    shown = {frozenset(h.names): h.log_evidence for h in (base, found, *others)}
    search = _search(base)
    search.root, search.evidences, search.ranked = frozenset(), lambda: shown, lambda: [found, *others]
    where = {"worst_run": "r0", "worst_start_s": 4.2, "worst_end_s": 6.1, "worst_ratio": 2.4, "moves_with": "rate"}
    left = SimpleNamespace(p=p, dependence=p, **where)
    return headline(search, Verdict("unexplained", ()), found, left, NOTHING_LEFT, FLOOR, noise).full


def test_the_unexplained_says_what_takes_a_part_of_it_and_which_larger_set_would_end_it():
    base = _made(train=(1.4,), unseen=(1.5,), score=0.0)
    part = _made("quadratic_damping", train=(1.2,), unseen=(1.3,), score=72.0)
    ends = _made("quadratic_damping", "trim_drift", train=(1.03,), unseen=(1.08,), score=60.0)
    misses = _made("quadratic_damping", "delay", train=(1.3,), unseen=(1.1,), score=65.0)
    said = unexplained(base, part, misses, ends)
    assert said == (
        "no effect of the catalogue explains what is missing: error 1.50 x the noise floor, 1.30 x the noise floor with "
        "quadratic_damping; what is left is largest in r0 at 4-6 s (2.4 x the average) and moves with rate; "
        "quadratic_damping+trim_drift leaves 1.08 x the noise floor, but is 12 log units less likely"
    )
    assert "less likely" not in unexplained(base, part, misses)


def test_the_unexplained_says_where_the_fitted_runs_are_left_with_more():
    base, part = (
        _made(train=(14.5,), unseen=(13.9,), score=0.0),
        _made("sway_coupling", train=(6.2,), unseen=(1.34,), score=340.0),
    )
    said = unexplained(base, part)
    assert "error 13.90 x the noise floor, 1.34 x the noise floor (6.20 x the noise floor on the fitted runs) with" in said


def test_the_unexplained_says_nothing_of_what_raises_the_error_or_is_less_likely_than_none():
    base = _made(train=(1.4,), unseen=(1.5,), score=0.0)
    wave = _made("wave", train=(1.2,), unseen=(1.9,), score=30.0)
    ends = _made("wave", "trim_drift", train=(1.03,), unseen=(1.08,), score=-2.0)
    assert unexplained(base, wave, ends).startswith(
        "no effect of the catalogue explains what is missing: error 1.50 x the noise floor; it is largest in r0"
    )
    assert "trim_drift" not in unexplained(base, wave, ends)


@pytest.mark.parametrize(("p", "moves", "passes"), [(1e-9, True, False), (0.0065, True, False), (0.5, False, True)])
def test_the_unexplained_moves_with_something_only_where_a_test_says_so(p, moves, passes):
    base, part = _made(train=(5.4,), unseen=(5.1,), score=0.0), _made("stall", train=(4.4,), unseen=(3.1,), score=565.0)
    said = unexplained(base, part, p=p, noise=Noise(0.004, 0.002, disturbance=0.0023, disturbance_time=4.4))
    assert ("moves with rate" in said) is moves
    assert ("the tests do not tell it from a disturbance moment of 0.0023 rad/s^2" in said) is passes
