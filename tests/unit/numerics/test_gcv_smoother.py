"""The smoother of helper signals: less noise than a one-second mean, jumps kept, gaps and held values passed over."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.numerics.gcv_smoother import gcv_smooth

NOISE = 0.02


def slow(time, rng):
    """A speed that swings and wanders."""
    step = float(time[1] - time[0])
    return 1.5 + 0.1 * np.sin(0.3 * time) + np.cumsum(rng.standard_normal(time.size)) * 0.005 * np.sqrt(step)


def off(values, truth):
    return float(np.std(values - truth))


@pytest.mark.parametrize("rate", [10, 20, 50])
def test_a_slow_speed_loses_more_of_its_noise_than_in_a_mean_of_a_second(rate):
    rng = np.random.default_rng(rate)
    time = np.arange(0.0, 60.0, 1.0 / rate)
    truth = slow(time, rng)
    noisy = truth + NOISE * rng.standard_normal(time.size)
    half = rate // 2
    mean = np.convolve(np.pad(noisy, half, "edge"), np.ones(2 * half + 1) / (2 * half + 1), "valid")
    assert off(gcv_smooth(time, noisy, fastest_s=0.35)[0], truth) < min(off(mean, truth), 0.25 * NOISE)


def test_what_moves_fast_is_kept_where_nothing_forbids_it():
    rng, time = np.random.default_rng(3), np.arange(0.0, 60.0, 0.05)
    roll = 0.1 * np.sin(2.0 * time)
    assert off(gcv_smooth(time, roll + 0.003 * rng.standard_normal(time.size))[0], roll) < 0.0015
    steps = np.where((time // 7) % 2 > 0, 50.0, 60.0)
    assert np.max(np.abs(gcv_smooth(time, steps)[0] - steps)[np.abs(time % 7 - 3.5) < 3.2]) < 0.05


def test_values_held_until_the_sensors_next_one_count_once():
    rng, time = np.random.default_rng(5), np.arange(0.0, 60.0, 0.05)
    truth = slow(time, rng)
    sampled = (truth + NOISE * rng.standard_normal(time.size))[::4]
    assert off(gcv_smooth(time, np.repeat(sampled, 4), fastest_s=0.35)[0], truth) < 0.5 * NOISE


def test_a_setting_that_stays_for_seconds_is_no_held_sensor():
    time = np.arange(0.0, 60.0, 0.05)
    setting = np.floor(time / 6.0) % 3.0
    assert np.max(np.abs(gcv_smooth(time, setting)[0] - setting)[np.abs(time % 6 - 3.0) < 2.7]) < 0.05


def test_gaps_are_bridged_and_nothing_is_shifted():
    rng, time = np.random.default_rng(7), np.arange(0.0, 60.0, 0.05)
    truth = 1.5 + 0.1 * np.sin(0.3 * time)
    noisy = truth + NOISE * rng.standard_normal(time.size)
    noisy[200:240] = np.nan
    found = gcv_smooth(time, noisy)[0]
    assert np.isfinite(found).all()
    assert off(found, truth) < 0.25 * NOISE
    lags = [float(np.sum((found[50:-50] - np.roll(truth, lag)[50:-50]) ** 2)) for lag in range(-10, 11)]
    assert abs(int(np.argmin(lags)) - 10) <= 2


@pytest.mark.parametrize("wild", [0.0, 3.0])
def test_wild_values_are_passed_over(wild):
    rng, time = np.random.default_rng(11), np.arange(0.0, 60.0, 0.05)
    truth = slow(time, rng)
    noisy = truth + NOISE * rng.standard_normal(time.size)
    noisy[rng.integers(0, time.size, 12)] = wild
    assert off(gcv_smooth(time, noisy, fastest_s=0.35)[0], truth) < 0.25 * NOISE


@given(st.integers(1, 30), st.floats(-1e3, 1e3), st.floats(-10.0, 10.0))
def test_a_straight_line_stays_itself(count, level, slope):
    time = 0.05 * np.arange(count)
    line = level + slope * time
    np.testing.assert_allclose(gcv_smooth(time, line)[0], line, atol=1e-7 * (1.0 + abs(level) + abs(slope)))


def test_random_errors_are_as_large_as_those_of_the_smoothed_signal():
    rng, time = np.random.default_rng(3), np.arange(0.0, 120.0, 0.1)
    truth = 1.5 + 0.2 * np.sin(0.3 * time) + 0.05 * np.sin(1.1 * time)
    off, told = [], []
    for _ in range(20):
        found, smoother = gcv_smooth(time, truth + 0.05 * rng.standard_normal(time.size))
        off.append(np.mean((found - truth) ** 2))
        told.append(np.mean([np.mean(e**2) for e in smoother.errors(time.size, 8)]))
    assert np.mean(told) == pytest.approx(np.mean(off), rel=0.3)
