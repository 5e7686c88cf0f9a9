"""What a slower sensor's number is repeated by is missing; what moves at its own rate, or in coarse steps, stays."""

import numpy as np
import pytest

from fieldsid.logs.convert.faults.repeats import without_repeats

RANDOM = np.random.default_rng(4)
MOVING = np.sin(0.02 * np.arange(600)) + 0.003 * RANDOM.standard_normal(600)


@pytest.mark.parametrize("phase", [0, 1])
@pytest.mark.parametrize("every", [2, 5])
def test_of_each_number_the_first_sample_stays(every, phase):
    at = (np.arange(600) - phase) // every * every + phase
    held = MOVING[at.clip(0)]
    own, (note,) = without_repeats("yaw_rad", held)
    fresh = np.arange(phase, 600, every)
    assert np.flatnonzero(np.isfinite(own)).tolist() == fresh.tolist()
    assert (own[fresh] == MOVING[fresh]).all()
    assert note.code == "repeated"
    assert note.data["value"] == every


def test_a_number_that_comes_twice_is_a_sample_of_its_own():
    held = np.repeat(np.round(MOVING[::5], 1), 5)
    own, notes = without_repeats("yaw_rad", held)
    assert notes
    assert np.isfinite(own).sum() == held.size // 5


STOPPED = np.concatenate((np.round(MOVING[:200], 4), np.full(400, 0.5)))
DUST = 1e-18 * np.interp(np.arange(600), np.arange(0, 600, 5), MOVING[::5])  # of a plane at rest in a simulation
OWN = (MOVING, np.round(MOVING, 1), STOPPED, np.zeros(600), np.full(600, np.nan), DUST, 1e-18 * np.repeat(MOVING[::5], 5))


@pytest.mark.parametrize("values", OWN)
def test_a_signal_of_its_own_rate_is_left_as_it_is(values):
    own, notes = without_repeats("yaw_rad", values)
    assert not notes
    assert own is values


def test_of_a_number_that_is_repeated_now_and_then_the_first_sample_stays():
    fresh = np.flatnonzero(np.random.default_rng(5).random(600) < 0.3)
    at = np.searchsorted(fresh, np.arange(600), side="right") - 1
    held = np.where(at < 0, np.nan, np.round(MOVING, 4)[fresh[at]])
    own, (note,) = without_repeats("yaw_rad", held)
    assert set(np.flatnonzero(np.isfinite(own))) >= set(fresh[np.append(True, np.diff(held[fresh]) != 0.0)])
    assert np.isfinite(own).sum() == note.data["count"] <= fresh.size
    assert note.code == "repeated"


@pytest.mark.parametrize("digits", [5, 12])
@pytest.mark.parametrize("rows", [3, 5])
def test_numbers_on_straight_lines_between_measurements_are_missing(rows, digits):
    knots = np.unique(np.append(np.arange(600 // rows) * rows + RANDOM.integers(0, 2, 600 // rows), (0, 599)))
    filled = np.round(np.interp(np.arange(600), knots, MOVING[knots]), digits)
    own, (note,) = without_repeats("yaw_rad", filled)
    kept = np.flatnonzero(np.isfinite(own))
    assert set(kept) <= set(knots)
    assert kept.size > 0.95 * knots.size
    assert note.code == "repeated"
    assert "interpolated between" in note.message


RAMPS = np.interp(np.arange(600), np.cumsum(RANDOM.integers(3, 60, 40)), RANDOM.standard_normal(40))
SMOOTH = np.sin(0.02 * np.arange(600))
PULSES = np.zeros(600)
for k in range(599):  # answers to fin steps at even intervals, in a few digits
    PULSES[k + 1] = PULSES[k] + 0.05 * (0.08 * (k // 40 % 4 - 1.5) - 0.84 * PULSES[k])


@pytest.mark.parametrize(
    "values",
    [RAMPS, SMOOTH, np.round(SMOOTH, 3), np.round(SMOOTH, 6), np.round(3.0 * PULSES, 3)],
    ids=["ramps", "smooth", "3", "6", "pulses"],
)
def test_ramps_and_smooth_numbers_are_no_lines_between_measurements(values):
    assert without_repeats("yaw_rad", values)[1] == []
