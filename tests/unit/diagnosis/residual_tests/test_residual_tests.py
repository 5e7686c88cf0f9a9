"""The test of a size that grows with the motion: how often it cries wolf, and whether it sees what it is for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.diagnosis.residual_tests.residual_tests import Innovations, _breusch_pagan, _homoscedasticity, _other_signals
from fieldsid.dynamics.free_run import command_record
from fieldsid.models.axis import Axis


def left(rng, growth, *, lively=True):
    """A run of white innovations whose slow part grows by `growth` over its mean with the square of the rate."""
    time = np.arange(0.0, 60.0, 0.05)
    fin = 0.2 * np.sign(np.sin(2.0 * np.pi * time / 9.0)) * (time % 30.0 < 18.0) if lively else np.zeros(time.size)
    rate = 0.3 * np.sin(2.0 * np.pi * time / 9.0) * (time % 30.0 < 18.0) if lively else np.zeros(time.size)
    size = np.sqrt(np.maximum(1.0 + growth * (rate**2 / max(np.mean(rate**2), 1e-12) - 1.0), 0.0))
    white = rng.standard_normal((2, time.size)) * size
    made = command_record(Axis.YAW, time, fin, speed=1.4)
    ok = np.ones(time.size, dtype=bool)
    return Innovations(replace(made, angle_ok=ok, rate_ok=ok), white, rate)


def test_white_innovations_are_seldom_said_to_grow():
    rng = np.random.default_rng(1)
    p = np.array([_breusch_pagan([left(rng, 0.0) for _ in range(3)])[0] for _ in range(300)])
    assert np.mean(p < 0.05) <= 0.08
    assert np.mean(p < 0.005) <= 0.02


def test_innovations_that_grow_with_the_motion_are_seen():
    rng = np.random.default_rng(2)
    p = [_breusch_pagan([left(rng, 0.8) for _ in range(3)])[0] for _ in range(20)]
    assert np.median(p) < 1e-4


def test_a_run_without_motion_says_nothing():
    rng = np.random.default_rng(3)
    assert _breusch_pagan([left(rng, 0.0, lively=False)])[0] == 1.0


def uneven(rng, burst):
    """A run whose innovations are `burst` times as large in a quarter of the time, three seconds each."""
    run = left(rng, 0.0)
    time = run.record.time
    size = np.where(np.sin(2.0 * np.pi * time / 12.0 + rng.uniform(0.0, 6.0)) > 0.7, burst, 1.0)
    return Innovations(run.record, run.white * size, run.rate)


@pytest.mark.slow
def test_a_steady_disturbance_is_seldom_said_to_be_uneven():
    rng = np.random.default_rng(4)
    p = np.array([_homoscedasticity([left(rng, 0.0) for _ in range(3)]) for _ in range(1000)])
    assert np.mean(p < 0.05) <= 0.06
    assert np.mean(p < 0.005) <= 0.012


def test_a_disturbance_of_another_size_in_every_run_is_even():
    rng = np.random.default_rng(5)
    runs = [[Innovations(r.record, k * r.white, r.rate) for k, r in zip((1.0, 3.0, 0.4), made, strict=True)] for made in
            ([left(rng, 0.0) for _ in range(3)] for _ in range(200))]  # fmt: skip
    assert np.mean([_homoscedasticity(r) < 0.05 for r in runs]) <= 0.08


def test_bursts_are_seen_where_no_one_of_them_stands_out():
    rng = np.random.default_rng(6)
    assert np.median([_homoscedasticity([uneven(rng, 2.5) for _ in range(3)]) for _ in range(20)]) < 1e-3


def rolling(rng, follows):
    """A run whose hull rolls; the innovations hold `follows` times the cube of its roll rate, over that of unit size."""
    run = left(rng, 0.0)
    time = run.record.time
    rolled = np.convolve(rng.standard_normal(time.size), np.exp(-time[:200] / 2.0) * np.sin(2.0 * time[:200]), "same")
    roll = 0.1 * rolled / rolled.std()
    cubed = np.gradient(roll, time) ** 3
    white = run.white + follows * cubed / cubed.std() * np.array([[0.0], [1.0]])
    return Innovations(replace(run.record, signals={"roll": roll}), white, run.rate)


@pytest.mark.slow
def test_innovations_are_seldom_said_to_follow_another_signal():
    rng = np.random.default_rng(7)
    p = np.array([_other_signals([rolling(rng, 0.0) for _ in range(3)])[0] for _ in range(400)])
    assert np.mean(p < 0.05) <= 0.085
    assert np.mean(p < 0.005) <= 0.0175


def test_a_moment_that_follows_the_roll_rate_is_seen_and_named():
    rng = np.random.default_rng(8)
    found = [_other_signals([rolling(rng, 0.5) for _ in range(3)]) for _ in range(10)]
    assert max(p for p, _ in found) < 1e-6
    assert {name for _, name in found} <= {"roll rate", "roll rate x |roll rate|"}


def test_a_log_without_other_signals_says_nothing_of_them():
    run = left(np.random.default_rng(9), 0.0)
    assert _other_signals([Innovations(replace(run.record, signals={}), run.white, run.rate)]) == (1.0, "")
