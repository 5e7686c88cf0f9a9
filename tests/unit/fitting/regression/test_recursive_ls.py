"""Recursive least squares: the compiled update against the equations as written, and steps over a record."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.fitting.regression.recursive_ls import INITIAL_VARIANCE, MEMORY, initial_memory, step, update

RNG = np.random.default_rng(4)
UPPER = np.triu_indices(4)


def unpacked(s):
    big = np.zeros((4, 4))
    big[UPPER] = s[4:]
    return big + np.triu(big, 1).T


def plain_update(theta, big, phi, target, beta):
    """Theta (p,) and P (p, p) after one row, as the equations are written."""
    gain = big @ phi
    spread = beta + phi @ gain
    theta = theta + gain * ((target - phi @ theta) / spread)
    big = big - np.outer(gain, gain) / spread
    return theta, big / beta if np.diag(big).max() < beta * INITIAL_VARIANCE else big


@pytest.mark.parametrize("beta", [1.0, 0.98])
def test_the_compiled_update_agrees_with_the_equations_as_they_are_written(beta):
    s, theta, big = initial_memory(stiff=True), np.zeros(4), np.eye(4) * INITIAL_VARIANCE
    for _ in range(200):
        phi, target = RNG.standard_normal(4), float(RNG.standard_normal())
        update(s, (*phi, target), beta)
        theta, big = plain_update(theta, big, phi, target, beta)
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


@pytest.mark.parametrize("by_rate", [True, False])
def test_steps_over_a_record_find_the_vehicle(by_rate):
    samples, memory, s, row = samples_of(*flown()), np.zeros(MEMORY), initial_memory(stiff=False), np.zeros((600, 5))
    used = [step(memory, s, 4.0, 1.0, 1 if by_rate else 2, samples, row, i) for i in range(600)]
    np.testing.assert_allclose(s[[0, 2, 3]], [1.2, -0.8, 0.02], rtol=1e-3)
    assert sum(used) == pytest.approx(600 - (15 if by_rate else 30), abs=2)


def test_a_step_before_the_filter_has_forgotten_its_start_does_not_count():
    memory, s, row = np.zeros(MEMORY), initial_memory(stiff=False), np.zeros((1, 5))
    counted = [step(memory, s, 4.0, 1.0, 1, np.array([[t, 0.1, 0.1, 0.0, 0.1, 1.0]]), row, 0) for t in np.arange(0.0, 2.0, 0.05)]
    assert counted.index(True) == 15
