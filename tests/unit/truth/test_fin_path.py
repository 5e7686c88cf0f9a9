"""The truth's fin path against figures worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from truth import kernel
from truth.maneuvers import Maneuver
from truth.noise import Clock
from truth.physics import Physics
from truth.simple import fly

CLOCK = Clock(0.05, 200)


def fin_for(command, **numbers):
    """Effective fin (n,) at the samples for a command given at the samples."""
    motion = fly(Physics(fin_limit=10.0, **numbers), CLOCK, Maneuver("given", command, np.full(command.size, kernel.OPEN)))
    return motion.fin


def step(size=0.2, at_s=1.0):
    return np.where(CLOCK.time >= at_s - 1e-9, size, 0.0)


def ramp(low, high):
    return np.concatenate([np.linspace(0, high, 50), np.linspace(high, low, 100), np.linspace(low, 0, 50)])


def test_without_effects_the_fin_is_the_held_command():
    command = ramp(-0.2, 0.3)
    assert fin_for(command) == pytest.approx(command, abs=1e-12)


def test_delay_shifts_the_command_by_whole_samples():
    command = ramp(-0.2, 0.3)
    assert fin_for(command, delay=0.25)[5:] == pytest.approx(command[:-5], abs=1e-12)


def test_delay_between_samples_switches_inside_the_interval():
    # 1.0 s + 0.12 s: still nothing in the step that starts at 1.10 s, all of it in the one at 1.15 s
    fin = fin_for(step(), delay=0.12)
    assert fin[22] == 0.0
    assert fin[23] == pytest.approx(0.2)


def test_servo_lag_answers_a_step_with_an_exponential():
    tau, t = 0.4, CLOCK.time
    # a fine step's mean lags its start by half of 2 ms
    expected = np.where(t >= 1.0 - 1e-9, 0.2 * (1 - np.exp(-(t - 1.0 + 0.001) / tau)), 0.0)
    assert fin_for(step(), servo_tau=tau) == pytest.approx(expected, abs=2e-6)


def test_second_order_servo_overshoots_as_its_damping_ratio_says():
    fin = fin_for(step(), servo_omega=4.0, servo_zeta=0.5)
    assert fin.max() / 0.2 - 1.0 == pytest.approx(np.exp(-np.pi * 0.5 / np.sqrt(0.75)), abs=5e-3)
    assert fin[-1] == pytest.approx(0.2, rel=1e-3)


def test_rate_limit_makes_a_ramp_of_that_slope():
    fin = fin_for(step(), max_rate=0.1)
    rising = (CLOCK.time > 1.2) & (CLOCK.time < 2.8)
    assert np.diff(fin[rising]) == pytest.approx(0.1 * 0.05, rel=1e-6)
    assert fin[CLOCK.time > 3.1] == pytest.approx(0.2)


def test_backlash_moves_only_after_half_the_gap_and_lags_by_it_either_way():
    command = ramp(-0.2, 0.3)
    fin = fin_for(command, backlash_gap=0.1)
    play = np.zeros(command.size)
    for k, d in enumerate(command):  # the play operator by hand
        before = play[k - 1] if k else 0.0
        play[k] = d - 0.05 if d - before > 0.05 else d + 0.05 if before - d > 0.05 else before
    assert fin == pytest.approx(play, abs=1e-12)
    assert fin[49] == pytest.approx(0.25)
    assert fin[149] == pytest.approx(-0.15)


def test_dead_zone_takes_its_width_off_and_the_sticking_one_is_all_or_nothing():
    command = np.repeat([0.02, 0.10, -0.10, -0.04, -0.02], 40)
    assert fin_for(command, deadband_width=0.05)[::40] == pytest.approx([0.0, 0.05, -0.05, 0.0, 0.0])
    assert fin_for(command, deadband_width=0.05, deadband_sticks=1.0)[::40] == pytest.approx([0.0, 0.10, -0.10, -0.04, 0.0])


def test_asymmetric_fin_scales_each_side():
    command = np.repeat([0.1, -0.1], 100)
    assert fin_for(command, asymmetry=0.3)[::100] == pytest.approx([0.13, -0.07])


def test_stall_falls_off_beyond_its_angle_on_both_sides():
    command = np.repeat([0.1, 0.25, -0.25, 0.0], 50)
    assert fin_for(command, stall_angle=0.15, stall_slope=-0.5)[::50] == pytest.approx([0.1, 0.10, -0.10, 0.0])


def test_smooth_stall_nears_the_sharp_one_as_the_blend_narrows():
    command = np.linspace(-0.3, 0.3, 200)
    sharp = fin_for(command, stall_angle=0.15, stall_slope=0.2)
    smooth = fin_for(command, stall_angle=0.15, stall_slope=0.2, stall_blend=0.002)
    assert smooth == pytest.approx(sharp, abs=0.0025)
    assert np.abs(fin_for(command, stall_angle=0.15, stall_slope=0.2, stall_blend=0.04) - sharp).max() > 0.01


def test_order_of_the_path_is_lag_before_dead_zone_before_asymmetry():
    fin = fin_for(step(0.1), servo_tau=0.2, deadband_width=0.02, asymmetry=0.5)
    assert fin[-1] == pytest.approx((0.1 - 0.02) * 1.5, rel=1e-6)
    assert fin[20] == 0.0
