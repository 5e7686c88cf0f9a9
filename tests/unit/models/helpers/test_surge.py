"""The surge without its noise: what thrust and fin have made of it is known better than the sensor says."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.models.helpers.surge import causes_of, smoothed_surge
from fieldsid.numerics.gcv_smoother import gcv_smooth

STEP, N = 0.05, 1200
TIME = STEP * np.arange(N)
NOISE, FASTEST_S, LAG_S = 0.02, 0.35, 4.0


def way(*, swings=True, loss=0.0):
    """A hull's thrust, fin and true surge: it gathers way behind its propeller and loses it by the fin's drag."""
    thrust = 50.0 * (1.0 + 0.1 * np.sign(np.sin(2.0 * np.pi * TIME / 13.0)) * swings)
    fin = 0.2 * np.maximum(np.sign(np.sin(2.0 * np.pi * TIME / 9.0)), 0.0) * (TIME > 20.0)
    surge = np.full(N, 1.4)
    for i in range(1, N):
        pull = 1.4 * np.sqrt(thrust[i - 1] / 50.0) - surge[i - 1]
        surge[i] = surge[i - 1] + STEP * (pull / LAG_S - loss * fin[i - 1] ** 2)
    return thrust, fin, surge


def noisy(values, seed=0):
    return values + NOISE * np.random.default_rng(seed).standard_normal(values.size)


@pytest.mark.parametrize(("swings", "loss"), [(True, 0.0), (False, 0.9), (True, 0.9)])
def test_a_surge_that_thrust_and_fin_move_loses_a_quarter_of_its_error_and_more(swings, loss):
    thrust, fin, surge = way(swings=swings, loss=loss)
    plain, found = [], []
    for seed in range(10):
        measured = noisy(surge, seed)
        plain.append(gcv_smooth(TIME, measured, fastest_s=FASTEST_S)[0] - surge)
        found.append(smoothed_surge(TIME, measured, causes_of(thrust, fin), fastest_s=FASTEST_S)[0] - surge)
    assert np.std(found) < 0.77 * np.std(plain)
    assert np.std(found) < 0.12 * NOISE


def test_a_surge_that_neither_moves_is_smoothed_as_it_is():
    thrust, fin, _ = way()
    measured = noisy(1.4 + 0.2 * np.sin(0.2 * TIME))
    found = smoothed_surge(TIME, measured, causes_of(thrust, fin), fastest_s=FASTEST_S)[0]
    np.testing.assert_allclose(found, gcv_smooth(TIME, measured, fastest_s=FASTEST_S)[0], atol=0.5 * NOISE)


def test_without_thrust_the_fin_tells():
    _, fin, surge = way(swings=False, loss=0.9)
    found = smoothed_surge(TIME, noisy(surge), causes_of(None, fin), fastest_s=FASTEST_S)[0]
    assert np.std(found - surge) < 0.15 * NOISE


def test_steady_causes_and_a_fin_that_never_moved_are_no_trouble():
    measured = noisy(np.full(N, 1.4))
    still = [np.full(N, 50.0), np.zeros(N)]
    found = smoothed_surge(TIME, measured, causes_of(*still), fastest_s=FASTEST_S)[0]
    assert np.std(found - 1.4) < 0.1 * NOISE
