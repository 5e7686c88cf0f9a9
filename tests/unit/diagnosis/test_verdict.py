"""The verdict on an effect that explains little of a large error."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fieldsid.diagnosis import verdict
from fieldsid.diagnosis.records import Errors
from fieldsid.diagnosis.residual_tests.residual_tests import ResidualTests
from fieldsid.models.effect import effect_named
from fieldsid.models.model import Noise

FLOOR = Noise(angle=0.005, rate=0.005)


def errors(ratio, runs=1):
    one = Errors(FLOOR.angle * ratio, FLOOR.rate * ratio)
    return replace(one, each=(one,) * runs)


def judged(
    monkeypatch, before, after, p, *,
    noiseless=False, settled=None, named=("servo_lag",), fitted=None, runs=1, gain=50.0,
):  # fmt: skip
    """The word for errors over the floor before and after on one unseen run; `fitted` are those on `runs` training runs."""
    monkeypatch.setattr(verdict, "reported_noise_floor", lambda *_of: FLOOR)
    monkeypatch.setattr(verdict, "rivals_of", lambda *_of: ())
    monkeypatch.setattr(verdict, "added_effects", lambda *_of: named)
    base = SimpleNamespace(
        names=(),
        selection_errors=errors(before),
        train=errors((fitted or (before, after))[0], runs),
        train_under=lambda _std: errors((fitted or (before, after))[0], runs),
        own_moment=0.0,
        log_evidence=0.0,
        unseen_under=lambda _std: (errors(before), errors(before)),
    )
    found = SimpleNamespace(
        names=named,
        effects=[effect_named(n) for n in named],
        selection_errors=errors(after),
        train=errors((fitted or (before, after))[1], runs),
        train_under=lambda _std: errors((fitted or (before, after))[1], runs),
        validation=(),
        validation_errors=errors(after),
        own_moment=0.0,
        log_evidence=gain,
        unseen_under=lambda _std: (errors(after), errors(settled or after)),
    )
    sums = {frozenset(): 0.0, frozenset(named): gain}
    search = SimpleNamespace(
        floor=FLOOR, root=frozenset(), known=(), base=lambda: base, is_noiseless=noiseless, evidences=lambda: sums
    )
    left = SimpleNamespace(p=p, dependence=p)
    return verdict.verdict_of(search, found, left, SimpleNamespace(noise=FLOOR)).word


@pytest.mark.parametrize(("p", "word"), [(0.6, "disturbed"), (1e-4, "unexplained")])
def test_an_effect_that_leaves_more_of_a_large_error_than_it_explains_is_not_what_is_missing(monkeypatch, p, word):
    assert judged(monkeypatch, 3.5, 3.3, p) == word


@pytest.mark.parametrize(("before", "after"), [(3.5, 1.6), (1.45, 1.4), (3.5, 2.4)])
def test_one_that_explains_most_of_it_or_leaves_little_is_named(monkeypatch, before, after):
    assert judged(monkeypatch, before, after, 0.6) == "effect"


def test_without_noise_no_floor_says_what_is_large(monkeypatch):
    assert judged(monkeypatch, 3.5, 3.3, 0.6, noiseless=True) == "effect"


@pytest.mark.parametrize(("settled", "word"), [(1.1, "effect"), (12.0, "unexplained")])
def test_an_error_that_the_fitted_runs_leave_open_counts_with_the_numbers_of_all_runs(monkeypatch, settled, word):
    found = judged(monkeypatch, 7.0, 12.8, 1e-9, settled=settled, fitted=(1.0, 1.0))
    assert found == word


@pytest.mark.parametrize(("runs", "word"), [(1, "effect"), (2, "disturbed")])
def test_an_effect_must_explain_most_of_what_all_runs_show_and_not_of_the_unseen_ones_alone(monkeypatch, runs, word):
    """One unseen run follows a small compass error; a moment in no catalogue stays in every run."""
    assert judged(monkeypatch, 3.0, 1.56, 0.6, fitted=(2.15, 2.11), runs=runs) == word


@pytest.mark.parametrize("noiseless", [False, True])
@pytest.mark.parametrize(
    ("before", "after", "named", "p", "word"),
    [
        (12.0, 3.5, "backlash", 1e-9, "effect"),
        (12.0, 6.0, "backlash", 1e-9, "unexplained"),
        (12.0, 6.0, "servo_lag", 1e-9, "effect"),
        (120.0, 6.0, "backlash", 1e-9, "effect"),
        (120.0, 60.0, "backlash", 1e-9, "unexplained"),
        (12.0, 6.0, "backlash", 0.6, "effect"),
    ],
)
def test_nothing_unusual_is_named_where_what_is_hidden_is_more_probably_in_no_set_tried(
    monkeypatch, before, after, named, p, word, noiseless
):
    """Better sensors show the same error of the same model as more times their noise; a sea hides nothing."""
    assert judged(monkeypatch, before, after, p, named=(named,), noiseless=noiseless) == word


@pytest.mark.parametrize(("unseen", "word"), [(2.63, "effect"), (2.8, "disturbed")])
def test_unseen_runs_too_mild_to_show_an_effect_in_a_sea_take_nothing_from_it(monkeypatch, unseen, word):
    assert judged(monkeypatch, 2.6, unseen, 0.6, fitted=(11.2, 2.7), runs=3) == word


def test_a_large_error_on_fitted_runs_is_one_that_is_left(monkeypatch):
    assert judged(monkeypatch, 2.0, 1.1, 1e-9, fitted=(3.5, 3.3), runs=2) == "unexplained"


@pytest.mark.parametrize(("after", "noiseless"), [(1.6, False), (1.4, False), (1.6, True)])
def test_what_is_left_beside_an_effect_takes_nothing_from_it_though_it_surely_follows_a_signal(monkeypatch, after, noiseless):
    assert judged(monkeypatch, 3.9, after, 1e-6, noiseless=noiseless) == "effect"


def test_a_set_as_likely_is_a_rival_though_its_free_run_is_worse():
    def model(name, evidence, error):
        return SimpleNamespace(names=(name,), log_evidence=evidence, selection_errors=errors(error))

    found, near, far = model("delay", 228.3, 1.17), model("servo_lag", 228.1, 1.30), model("clock_offset", 210.2, 1.29)
    sums = {frozenset(h.names): h.log_evidence for h in (found, near, far)}
    work = SimpleNamespace(records=(1, 2), floor=FLOOR, evidences=lambda: sums, ranked=lambda: [found, near, far])
    assert verdict.rivals_of(work, found) == (near,)


def test_a_probability_is_left_for_what_is_in_no_set_that_was_tried():
    found = verdict.probabilities({frozenset(): 0.0, frozenset({"delay"}): 800.0, frozenset({"servo_lag"}): 796.0})
    assert sum(found.values()) == pytest.approx(1.0 - verdict.UNTRIED_LEAST)
    alike = found[frozenset({"servo_lag"})] / found[frozenset({"delay"})]
    assert alike == pytest.approx(np.exp(-4.0 / verdict.EVIDENCE_TEMPERATURE))


@pytest.mark.parametrize(("left", "least", "most"), [(1.0, 0.004, 0.006), (1.1, 0.004, 0.02), (1.4, 0.05, 0.15), (4.0, 0.4, 0.6)])
def test_the_more_a_named_set_leaves_the_likelier_is_something_that_was_not_tried(left, least, most):
    assert least < verdict.untried_probability(left) < most
    found = verdict.probabilities({frozenset(): 0.0, frozenset({"delay"}): 800.0}, left)
    assert found[frozenset({"delay"})] == pytest.approx(1.0 - verdict.untried_probability(left))


@pytest.mark.parametrize(
    ("named", "unseen", "settled", "left", "unexplained"),
    [
        ((), 2.5, 2.5, 2.5, False),
        (("servo_lag",), 2.5, 2.5, 2.5, True),
        (("servo_lag",), 1.3, 1.3, 1.3, False),
        (("servo_lag",), 5.4, 1.3, 1.3, False),  # the fitted runs leave a number open that all runs tell
        (("servo_lag",), 1.3, 5.4, 1.3, False),
    ],
)
def test_what_could_be_a_disturbance_is_unexplained_where_effects_are_named_and_no_disturbance_is(
    named, unseen, settled, left, unexplained
):
    fitted = errors(1.2)
    h = SimpleNamespace(
        names=named, train_under=lambda _std: fitted, selection_errors=errors(unseen), train=fitted, validation=(),
        validation_errors=None, own_moment=0.0, log_evidence=0.0, unseen_under=lambda _std: (errors(unseen), errors(settled)),
    )  # fmt: skip
    tests = ResidualTests(0.5, 0.5, 0.5, "r0", 1.0, 3.0, 2.0, "")
    found = verdict.left_of(SimpleNamespace(root=frozenset(), base=lambda: h), h, h, tests, FLOOR)
    assert (found.unexplained, found.ratio) == (unexplained, pytest.approx(left))
