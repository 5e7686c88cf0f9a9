"""What an addition must bring to be named, and the order effects are named in, on hypotheses made by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fieldsid.diagnosis.evidence.acceptance import (
    compared_error,
    compared_errors,
    compared_share,
    gains_evidence,
    is_accepted,
    keeps_error,
    leaves_error,
    lowers_error,
)
from fieldsid.diagnosis.records import Errors
from fieldsid.diagnosis.verdict import added_effects
from fieldsid.models.effect import effect_named
from fieldsid.models.model import Noise

FLOOR = Noise(0.004, 0.002)


def grown(errors, own_moment):
    """Errors where the runs may have moments of their own: the larger those may be, the less is left."""
    return Errors(errors.angle_rms_rad / (1.0 + own_moment), errors.rate_rms_rad_s)


def hypothesis(*names, gain=0.0, over=1.0, train=1.0, settled=None, own_moment=0.0):
    """One with this much log evidence beyond the base, half of it learned, and errors over the floor.

    `settled` is the one on unseen runs with the numbers of all runs, by default that with those of the fitted.
    """
    errors = [Errors(FLOOR.angle * e, FLOOR.rate * e) for e in (over, train, over if settled is None else settled)]
    effects = tuple(effect_named(n) for n in names)
    return SimpleNamespace(
        names=names,
        effects=effects,
        log_likelihood=0.5 * gain,
        log_evidence=gain,
        selection_errors=errors[0],
        train=errors[1],
        error_of_all_runs=lambda floor: float(np.hypot(errors[0].over(floor), errors[1].over(floor)) / 2**0.5),
        unseen_errors=(errors[0], errors[2]),
        own_moment=own_moment,
        train_under=lambda std: grown(errors[1], std),
        unseen_under=lambda std: (grown(errors[0], std), grown(errors[2], std)),
    )


def at(over):
    """Errors over the floor."""
    return Errors(FLOOR.angle * over, FLOOR.rate * over)


BASE = hypothesis(over=1.2)


@pytest.mark.parametrize(("over", "named"), [(1.19, False), (1.12, False), (1.09, True)])
def test_a_name_asks_for_a_twelfth_of_the_error(over, named):
    assert is_accepted(BASE, hypothesis("servo_lag", gain=50.0, over=over)) == named


@pytest.mark.parametrize(("over", "named"), [(1.06, True), (1.14, True), (1.16, False)])
def test_an_unseen_run_that_stays_at_the_noise_speaks_against_nothing_that_a_visible_error_asks_for(over, named):
    base = hypothesis(over=1.01, train=2.5)
    found = hypothesis("backlash", gain=50.0, over=over, train=1.02)
    assert lowers_error(base, found, FLOOR) == named
    assert not lowers_error(base, found)


@pytest.mark.parametrize(("over", "kept"), [(1.1, True), (1.22, True), (1.3, False)])
def test_another_variant_may_not_raise_the_error_on_unseen_runs(over, kept):
    assert keeps_error(BASE, hypothesis("servo_lag", gain=50.0, over=over)) == kept


@pytest.mark.parametrize(("gain", "paid"), [(-1.0, False), (1.0, True)])
def test_the_error_alone_is_not_enough(gain, paid):
    found = hypothesis("servo_lag", gain=gain, over=1.0)
    assert (is_accepted(BASE, found), gains_evidence(BASE, found)) == (paid, paid)


@pytest.mark.parametrize(
    ("over", "train", "counts"),
    [(1.0, 1.5, True), (1.2, 1.3, True), (1.19, 1.45, False), (1.0, 1.7, True), (1.0, 1.9, False), (1.3, 1.0, False)],
)
def test_an_addition_matters_on_fitted_or_on_unseen_runs_if_it_lowers_all_and_no_unseen_one_rises(over, train, counts):
    base = hypothesis(over=1.2, train=1.5)
    assert lowers_error(base, hypothesis("servo_lag", gain=50.0, over=over, train=train)) == counts


@pytest.mark.parametrize("lacking", [2.0, 0.01])
def test_both_models_are_compared_with_the_moments_of_the_runs_own_that_the_more_evident_tells(lacking):
    lacks, found = hypothesis(over=1.2, own_moment=lacking), hypothesis("current", gain=50.0, over=1.0, own_moment=0.1)
    before, now = compared_errors(lacks, found)
    assert before.angle_rms_rad == pytest.approx(1.2 * FLOOR.angle / 1.1)
    assert now.angle_rms_rad == pytest.approx(FLOOR.angle / 1.1)
    assert is_accepted(lacks, found)
    assert not is_accepted(found, lacks)


@pytest.mark.parametrize(
    ("over", "settled", "train", "left"),
    [
        (1.1, 1.8, 1.0, 1.1),
        (1.8, 1.0, 1.0, 1.0),
        (1.1, 1.1, 1.3, 1.3),
    ],
)
def test_the_error_left_is_the_one_that_an_addition_is_compared_by(over, settled, train, left):
    base = hypothesis(over=1.2, settled=3.0, train=2.0)
    found = hypothesis("servo_lag", gain=50.0, over=over, settled=settled, train=train)
    assert compared_error(base, found, FLOOR) == pytest.approx(left)
    was, now = compared_errors(base, found)
    assert now.over(FLOOR) <= compared_error(base, found, FLOOR)
    excess = [unseen.over(FLOOR) ** 2 + h.train.over(FLOOR) ** 2 - 2.0 for unseen, h in ((was, base), (now, found))]
    assert compared_share(base, found, FLOOR) == pytest.approx(1.0 - excess[1] / excess[0])


@pytest.mark.parametrize(
    ("gain", "train", "accepted"),
    [
        (50.0, 1.3, True),
        (50.0, 1.0, False),  # neither error falls by much
    ],
)
def test_a_value_that_training_runs_leave_to_chance_is_judged_by_what_all_runs_tell(gain, train, accepted):
    lacks, found = hypothesis(over=1.19, train=train, settled=1.11), hypothesis("gyro_bias", gain=gain, over=1.95, settled=1.03)
    assert lowers_error(lacks, found, FLOOR) is accepted


def test_numbers_of_every_runs_own_must_be_learned_on_the_runs_fitted_to():
    found = hypothesis("wave", gain=7.0, over=1.0)
    assert not is_accepted(BASE, found)
    assert is_accepted(BASE, hypothesis("wave", gain=20.0, over=1.0))


def test_a_third_effect_must_bring_what_a_first_must():
    two = hypothesis("servo_lag", "gyro_bias", gain=50.0, over=1.2)
    assert not is_accepted(two, hypothesis("servo_lag", "gyro_bias", "stall", gain=99.0, over=1.12))
    assert is_accepted(two, hypothesis("servo_lag", "gyro_bias", "stall", gain=99.0, over=1.09))


@pytest.mark.parametrize(("over", "train", "more"), [(1.01, 1.01, False), (1.03, 1.0, True), (1.0, 1.03, True)])
def test_what_is_left_may_be_left_on_either_runs(over, train, more):
    assert leaves_error(hypothesis(over=over, train=train), FLOOR) == more


@pytest.mark.parametrize(("over", "train"), [(3.0, 1.0), (1.2, 3.0)])
def test_the_effect_whose_lack_costs_most_on_all_runs_is_named_first(over, train):
    both = hypothesis("speed_varying", "current", gain=90.0, over=1.0)
    likely, useful = hypothesis("speed_varying", gain=60.0, over=over, train=train), hypothesis("current", gain=50.0, over=1.3)
    search = SimpleNamespace(known=(), floor=FLOOR, tried={frozenset(h.names): h for h in (both, likely, useful)})
    assert added_effects(search, both) == ("current", "speed_varying")


def test_an_effect_without_which_the_rest_promised_nothing_is_named_first():
    both, alone = hypothesis("speed_varying", "stall", gain=90.0, over=1.0), hypothesis("stall", gain=80.0, over=1.2)
    search = SimpleNamespace(known=(), floor=FLOOR, tried={frozenset(h.names): h for h in (both, alone)})
    assert added_effects(search, both) == ("stall", "speed_varying")


@pytest.mark.parametrize(
    ("before", "after", "least", "counts"),
    [
        ((1.17, 1.04), (1.08, 1.0), 1.15, True),
        ((1.17, 1.04), (1.13, 1.03), 1.15, False),
        ((1.1, 1.04), (1.02, 1.0), 1.15, False),
        ((1.1, 1.04), (1.02, 1.0), 1.02, True),
        ((1.1, 1.04), (1.06, 1.03), 1.02, False),
        ((1.036, 1.033), (1.021, 1.013), 1.02, True),
        ((1.03, 1.08), (1.027, 1.01), 1.02, False),  # unseen runs are left as they were
        ((1.01, 1.08), (1.01, 1.01), 1.02, True),  # and here at the noise
        ((1.01, 1.01), (1.0, 1.0), 1.02, False),
    ],
)
def test_near_the_floor_an_addition_counts_that_explains_more_than_it_leaves(before, after, least, counts):
    base = hypothesis("servo_lag", over=before[0], train=before[1])
    more = hypothesis("servo_lag", "stall", gain=50.0, over=after[0], train=after[1])
    assert is_accepted(base, more, FLOOR, least) == counts
    assert not is_accepted(base, more)


def test_a_visible_error_in_one_run_asks_for_what_explains_it():
    base, more = hypothesis("servo_lag", over=1.1, train=1.04), hypothesis("servo_lag", "current", gain=50.0, over=1.02)
    assert not is_accepted(base, more, FLOOR)
    base.unseen_under = lambda _std: (replace(base.selection_errors, each=(at(1.0), at(1.19))),)
    more.unseen_under = lambda _std: (more.selection_errors,)
    assert is_accepted(base, more, FLOOR)


def test_an_error_that_rises_with_the_numbers_of_all_runs_speaks_not_against_one_that_falls():
    base = hypothesis(over=1.14, train=2.2, settled=1.2)
    assert is_accepted(base, hypothesis("backlash", gain=50.0, over=1.12, train=1.1, settled=2.2), FLOOR)


@pytest.mark.parametrize(
    ("before", "after", "counts"),
    [
        ((1.02, 1.1), (1.01, 0.99), False),
        ((1.3, 1.2), (1.12, 1.2), False),
        ((1.3, 1.2), (1.08, 1.2), True),
        ((3.7, 14.8), (3.8, 12.6), False),  # the numbers of all runs tell nothing of either
        ((1.32, 5.2), (1.5, 1.13), True),
    ],
)
def test_each_model_counts_with_the_better_of_its_two_errors_on_unseen_runs(before, after, counts):
    base = hypothesis(over=before[0], settled=before[1])
    found = hypothesis("current", gain=50.0, over=after[0], settled=after[1])
    assert is_accepted(base, found, FLOOR) == counts


@pytest.mark.parametrize(("settled", "counts"), [(1.0, True), (1.22, True), (1.3, False)])
def test_what_the_fitted_runs_leave_open_is_judged_with_the_numbers_of_all_runs(settled, counts):
    base, found = hypothesis(over=1.2, train=3.0), hypothesis("current", gain=50.0, over=5.0, train=1.0, settled=settled)
    assert (keeps_error(base, found), lowers_error(base, found)) == (counts, counts)
