"""The measured sway behind its noise: what the hull's own drift explains need not be smoothed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fieldsid.models.helpers.cross_flow_speed import cross_speed
from fieldsid.numerics.first_order_lag import first_order_lag
from fieldsid.numerics.gcv_smoother import gcv_smooth

NOISE = 0.02


def turning(rate_hz, *, arm=0.0, quadratic=0.0, seed=1):
    """Time, sway of a hull that turns now and then, its rate, and the fin: v' = -0.8 v - q v|v| - 0.9 r + 0.05 delta."""
    time = np.arange(0.0, 60.0, 1.0 / rate_hz)
    fin = 0.2 * np.sign(np.sin(0.5 * time)) * (np.sin(0.13 * time) > -0.3)
    rate = first_order_lag(np.diff(time), 0.8 * fin, 1.2)

    def slope(t, v):
        return -0.8 * v - quadratic * v * np.abs(v) - 0.9 * np.interp(t, time, rate) + 0.05 * np.interp(t, time, fin)

    sway = solve_ivp(slope, (0.0, time[-1]), [0.05], t_eval=time, max_step=0.05, rtol=1e-8, atol=1e-10).y[0] + arm * rate
    return time, sway, rate, fin, np.random.default_rng(seed)


def errors(time, sway, rate, fin, rng):
    """Error of the plain smoother and of the one beside the rate, both under the same noise."""
    noisy = sway + NOISE * rng.standard_normal(time.size)
    seen = rate + 0.003 * rng.standard_normal(time.size)
    beside = cross_speed(time, noisy, seen, np.ones(time.size, dtype=bool), fin)
    return np.std(gcv_smooth(time, noisy) - sway), np.std(beside - sway)


@pytest.mark.parametrize("rate_hz", [10, 20, 50])
@pytest.mark.parametrize("arm", [0.0, 0.4])
def test_what_follows_the_rate_loses_half_of_the_noise_that_smoothing_leaves(rate_hz, arm):
    plain, beside = errors(*turning(rate_hz, arm=arm))
    assert beside < 0.6 * plain


def test_a_sway_of_another_shape_is_no_worse_than_smoothed():
    plain, beside = errors(*turning(20, quadratic=10.0))
    assert beside < plain


def test_a_sway_that_has_nothing_to_do_with_the_rate_is_smoothed_as_before():
    time, _, rate, fin, rng = turning(20)
    plain, beside = errors(time, 0.2 * np.sin(0.9 * time), rate, fin, rng)
    assert beside == pytest.approx(plain, rel=0.1)


def test_without_a_rate_the_sway_is_smoothed():
    time, sway, rate, fin, rng = turning(20)
    noisy = sway + NOISE * rng.standard_normal(time.size)
    got = cross_speed(time, noisy, rate, np.zeros(time.size, dtype=bool), fin)
    np.testing.assert_array_equal(got, gcv_smooth(time, noisy))


def test_gaps_of_either_signal_are_bridged():
    time, sway, rate, fin, rng = turning(20)
    noisy = sway + NOISE * rng.standard_normal(time.size)
    noisy[200:260] = np.nan
    ok = np.ones(time.size, dtype=bool)
    ok[500:520] = False
    got = cross_speed(time, noisy, np.where(ok, rate, 0.0), ok, fin)
    assert np.max(np.abs(got - sway)[200:260]) < NOISE


def test_the_lag_is_that_of_its_equation():
    time = np.arange(0.0, 5.0, 0.1)
    signal = np.sin(time) + 0.3 * time
    want = solve_ivp(
        lambda t, y: (np.interp(t, time, signal) - y) / 0.7, (0.0, time[-1]), [signal[0]], t_eval=time, max_step=0.01, rtol=1e-10
    ).y[0]
    np.testing.assert_allclose(first_order_lag(np.diff(time), signal, 0.7), want, atol=1e-6)
