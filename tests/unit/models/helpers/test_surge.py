"""The surge without its noise: what thrust and turning have made of it is known better than the sensor says."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.models.helpers.surge import causes_of, surge_behind
from fieldsid.numerics.gcv_smoother import gcv_smooth

STEP, N = 0.05, 1200
TIME = STEP * np.arange(N)
NOISE, FASTEST_S, LAG_S = 0.02, 0.35, 4.0


def way(*, swings=True, loss=0.0):
    """A hull's thrust, turn rate, fin and true surge: it gathers way behind its propeller and loses it in turns."""
    thrust = 50.0 * (1.0 + 0.1 * np.sign(np.sin(2.0 * np.pi * TIME / 13.0)) * swings)
    rate = 0.3 * np.sign(np.sin(2.0 * np.pi * TIME / 9.0))
    surge = np.full(N, 1.4)
    for i in range(1, N):
        pull = 1.4 * np.sqrt(thrust[i - 1] / 50.0) - surge[i - 1]
        surge[i] = surge[i - 1] + STEP * (pull / LAG_S - loss * rate[i - 1] ** 2 * (TIME[i] > 20.0))
    return thrust, rate * (TIME > 20.0), 0.2 * np.sign(rate), surge


def noisy(values, seed=0):
    return values + NOISE * np.random.default_rng(seed).standard_normal(values.size)


@pytest.mark.parametrize(("swings", "loss"), [(True, 0.0), (False, 0.4), (True, 0.4)])
def test_a_surge_that_thrust_and_turning_move_loses_a_quarter_of_its_error_and_more(swings, loss):
    thrust, rate, fin, surge = way(swings=swings, loss=loss)
    plain, found = [], []
    for seed in range(10):
        measured = noisy(surge, seed)
        plain.append(gcv_smooth(TIME, measured, fastest_s=FASTEST_S) - surge)
        found.append(surge_behind(TIME, measured, causes_of(thrust, rate, fin), fastest_s=FASTEST_S) - surge)
    assert np.std(found) < 0.77 * np.std(plain)
    assert np.std(found) < 0.12 * NOISE


def test_a_surge_that_neither_moves_is_smoothed_as_it_is():
    thrust, rate, fin, _ = way()
    measured = noisy(1.4 + 0.2 * np.sin(0.2 * TIME))
    found = surge_behind(TIME, measured, causes_of(thrust, rate, fin), fastest_s=FASTEST_S)
    np.testing.assert_allclose(found, gcv_smooth(TIME, measured, fastest_s=FASTEST_S), atol=0.5 * NOISE)


def test_without_thrust_turning_and_fin_tell():
    _, rate, fin, surge = way(swings=False, loss=0.4)
    found = surge_behind(TIME, noisy(surge), causes_of(None, rate, fin), fastest_s=FASTEST_S)
    assert np.std(found - surge) < 0.15 * NOISE


def test_steady_causes_and_a_fin_that_never_moved_are_no_trouble():
    measured = noisy(np.full(N, 1.4))
    still = [np.full(N, 50.0), np.zeros(N), np.zeros(N)]
    found = surge_behind(TIME, measured, causes_of(*still), fastest_s=FASTEST_S)
    assert np.std(found - 1.4) < 0.1 * NOISE
