"""Recursive least squares: the compiled update against the equations as written, and single steps against a sweep."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.rls_speed import plain_update

from fieldsid.fitting.regression.bias_compensation import noise_share
from fieldsid.fitting.regression.recursive_ls import (
    INITIAL_VARIANCE,
    MEMORY,
    initial_memory,
    noise_of,
    step,
    sweep,
    update,
)

RNG = np.random.default_rng(4)
UPPER = np.triu_indices(4)


def unpacked(s):
    big = np.zeros((4, 4))
    big[UPPER] = s[4:]
    return big + np.triu(big, 1).T


@pytest.mark.parametrize("beta", [1.0, 0.98])
def test_the_compiled_update_agrees_with_the_equations_as_they_are_written(beta):
    s, theta, big = initial_memory(stiff=True), np.zeros(4), np.eye(4) * INITIAL_VARIANCE
    for _ in range(200):
        phi, target = RNG.standard_normal(4), float(RNG.standard_normal())
        before = target - phi @ theta
        error, left = update(s, (*phi, target), beta)
        theta, big = plain_update(theta, big, phi, target, beta)
        assert error == pytest.approx(before, rel=1e-6, abs=1e-9)
        assert error * left == pytest.approx(target - phi @ theta, rel=1e-6, abs=1e-9)
    np.testing.assert_allclose(s[:4], theta, rtol=1e-7)
    np.testing.assert_allclose(unpacked(s), big, rtol=1e-6, atol=1e-12)


def test_without_forgetting_it_ends_at_the_block_least_squares():
    s, rows, targets = initial_memory(stiff=True), RNG.standard_normal((60, 4)), RNG.standard_normal(60)
    for phi, target in zip(rows, targets, strict=True):
        update(s, (*phi, target), 1.0)
    np.testing.assert_allclose(s[:4], np.linalg.lstsq(rows, targets, rcond=None)[0], rtol=1e-6)


def test_without_stiffness_its_slot_stays_at_zero():
    s = initial_memory(stiff=False)
    for phi in RNG.standard_normal((50, 4)):
        update(s, (*phi, 1.0), 0.99)
    assert s[1] == 0.0
    assert not s[[5, 8, 9, 10]].any()


def test_p_does_not_wind_up_while_nothing_is_excited():
    s = initial_memory(stiff=False)
    for _ in range(20000):
        update(s, (0.0, 0.0, 0.0, 1.0, 0.1), 0.99)
    assert np.isfinite(s).all()
    assert s[[4, 8, 11, 13]].max() <= INITIAL_VARIANCE / 0.99


def flown(n=600, h=0.05):
    """Yaw r' = -1.2 r - 0.8 d + 0.02 with a command that switches now and then, held between samples."""
    fin = 0.2 * np.sign(np.sin(np.arange(n) * 0.045))
    fade = np.exp(-1.2 * h)
    rate, angle = np.zeros(n), np.zeros(n)
    for i in range(n - 1):
        goal = (-0.8 * fin[i] + 0.02) / 1.2
        rate[i + 1] = goal + (rate[i] - goal) * fade
        angle[i + 1] = angle[i] + goal * h + (rate[i] - goal) * (1.0 - fade) / 1.2
    return np.arange(n) * h, fin, angle, rate


def samples_of(time, fin, angle, rate):
    held = np.r_[0.0, fin[:-1]]
    return np.column_stack([time, held, held, angle, rate, np.ones(time.size)])


def swept(samples, *, by_rate=True, bandwidth=4.0, forgetting=1.0, noise=None):
    """Damping, authority and trim after each sample (n, 3), and the rows (n, 5)."""
    values, spread, rows = (np.empty((len(samples), size)) for size in (4, 4, 5))
    order, noise = 1 if by_rate else 2, np.zeros(5) if noise is None else noise
    memory, s = np.zeros(MEMORY), initial_memory(stiff=False)
    sweep(memory, s, bandwidth, forgetting, order, 3, noise, samples, values, spread, rows)
    return values[:, [0, 2, 3]], rows


@pytest.mark.parametrize("by_rate", [True, False])
def test_a_sweep_finds_the_vehicle(by_rate):
    found, _ = swept(samples_of(*flown()), by_rate=by_rate)
    np.testing.assert_allclose(found[-1], [1.2, -0.8, 0.02], rtol=1e-3)


def test_the_sweep_does_what_single_samples_do():
    samples = samples_of(*flown())
    values, rows = swept(samples, forgetting=0.999)
    memory, s, row = np.zeros(MEMORY), initial_memory(stiff=False), np.zeros((600, 5))
    for i in range(600):
        step(memory, s, 4.0, 0.999, 1, samples, row, i)
        np.testing.assert_array_equal(s[[0, 2, 3]], values[i])
    used = np.isfinite(rows[:, 4])
    assert used.sum() == pytest.approx(600 - 15, abs=2)


@pytest.mark.parametrize("by_rate", [True, False])
def test_the_bias_of_sensor_noise_is_taken_out_when_the_noise_is_known(by_rate):
    time, fin, angle, rate = flown(20000)
    rng = np.random.default_rng(8)
    angle, rate = angle + 0.004 * rng.standard_normal(20000), rate + 0.05 * rng.standard_normal(20000)
    noise = noise_of(noise_share(1 if by_rate else 2, 8.0, 0.05, angle=0.004, rate=0.05))
    samples = samples_of(time, fin, angle, rate)
    plain, mended = (swept(samples, by_rate=by_rate, bandwidth=8.0, noise=known)[0][-1] for known in (None, noise))
    assert abs(plain[0] / 1.2 - 1.0) > 0.03
    assert abs(mended[0] / 1.2 - 1.0) < 0.01


def test_a_step_before_the_filter_has_forgotten_its_start_does_not_count():
    memory, s, row = np.zeros(MEMORY), initial_memory(stiff=False), np.zeros((1, 5))
    counted = [step(memory, s, 4.0, 1.0, 1, np.array([[t, 0.1, 0.1, 0.0, 0.1, 1.0]]), row, 0) for t in np.arange(0.0, 2.0, 0.05)]
    assert counted.index(True) == 15
