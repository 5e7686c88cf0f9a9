"""The one-axis truth against solutions in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from truth import kernel
from truth.maneuvers import Maneuver, pulses
from truth.noise import Clock, calm
from truth.physics import Physics
from truth.simple import fly, replay

CLOCK = Clock(0.05, 600)
T = CLOCK.time


def steered(fin, **numbers):
    """Fly a constant fin from rest at zero angle."""
    pitching = numbers.pop("pitching", False)
    plan = Maneuver("constant", np.full(CLOCK.samples, fin), np.full(CLOCK.samples, kernel.OPEN))
    return fly(Physics(fin_limit=10.0, **numbers), CLOCK, plan, pitching=pitching, depth=numbers.get("depth_reference", 2.0))


def test_yaw_answers_a_step_with_the_exact_exponential():
    motion = steered(0.2, damping=1.5, authority=-1.2)
    steady = -1.2 * 0.2 / 1.5
    assert motion.rate == pytest.approx(steady * (1 - np.exp(-1.5 * T)), abs=1e-9)
    assert motion.angle == pytest.approx(steady * (T - (1 - np.exp(-1.5 * T)) / 1.5), abs=1e-9)


def test_pitch_comes_to_rest_where_the_righting_moment_balances_the_fin():
    motion = steered(0.1, damping=1.0, stiffness=0.8, authority=1.6, pitching=True)
    assert motion.angle[-1] == pytest.approx(1.6 * 0.1 / 0.8, rel=1e-4)


def test_large_angle_righting_balances_with_the_sine_and_the_trim_with_the_cosine():
    motion = steered(0.1, damping=2.0, stiffness=0.8, authority=6.0, trim=0.1, righting=1.0, pitching=True)
    angle = motion.angle[-1]
    assert 0.8 * np.sin(angle) == pytest.approx(0.6 + 0.1 * np.cos(angle), abs=1e-4)


def test_quadratic_damping_ends_at_the_root_of_its_balance():
    motion = steered(0.2, damping=0.5, authority=1.0, quadratic=2.0)
    assert motion.rate[-1] == pytest.approx((-0.5 + np.sqrt(0.25 + 8 * 0.2)) / 4.0, rel=1e-6)


def test_unstable_hull_is_held_by_its_quadratic_damping():
    motion = steered(0.05, damping=-0.1, authority=1.0, quadratic=1.0)
    assert motion.rate[-1] == pytest.approx((0.1 + np.sqrt(0.01 + 4 * 0.05)) / 2.0, rel=1e-3)


@pytest.mark.parametrize(("s", "p"), [(0.0, 0.3), (0.05, 0.3), (-0.1, 0.25), (0.4, 0.1), (-0.3, -0.2), (0.2, 0.0)])
def test_crossflow_is_the_integral_along_the_hull(s, p):
    xi = (np.arange(200_000) + 0.5) / 200_000 - 0.5
    flow = s + xi * p
    assert kernel.crossflow(s, p) == pytest.approx(32 * np.mean(flow * np.abs(flow) * xi), abs=1e-8)


def test_crossflow_without_sway_is_the_square_of_the_rate():
    assert kernel.crossflow(0.0, -0.3) == pytest.approx(-0.09)


def test_sway_coupling_has_the_steady_rate_of_its_two_balances():
    # 0 = -a11 v - a12 r + b1 d and 0 = -a22 r + b2 d - a21 v
    motion = steered(0.1, damping=1.0, authority=1.0, cross_damping=0.8, cross_rate=0.6, cross_fin=0.3, cross_moment=-0.7)
    v, r = np.linalg.solve([[0.8, 0.6], [-0.7, 1.0]], [0.03, 0.1])
    assert motion.rate[-1] == pytest.approx(r, rel=1e-4)
    assert motion.cross[-1] == pytest.approx(v, rel=1e-4)


def test_speed_varying_scales_authority_and_damping_with_the_speed():
    inputs = calm(CLOCK, 50.0)
    inputs[kernel.THRUST] = 50.0 * 1.44  # the speed goes to 1.2 times
    plan = Maneuver("constant", np.full(CLOCK.samples, 0.1), np.full(CLOCK.samples, kernel.OPEN))
    motion = fly(Physics(damping=1.0, authority=1.0, speed_varying=1.0), CLOCK, plan, inputs)
    assert motion.surge[-1] == pytest.approx(1.8, rel=1e-3)
    assert motion.rate[-1] == pytest.approx(0.1 * 1.2, rel=1e-3)


@pytest.mark.parametrize(
    ("numbers", "rate"),
    [
        ({"drift": 0.01}, 0.01 * (T[-1] - 1.0)),
        ({"thrust_moment": 0.002}, 0.1),
        ({"speed_moment": 0.1, "speed_reference": 1.0}, 0.125),
        ({"step_time": 3.0, "step_moment": 0.04}, 0.04),
        ({"depth_moment": 0.1, "depth_reference": 1.5}, 0.0),
    ],
)
def test_moments_lead_to_their_steady_rate(numbers, rate):
    assert steered(0.0, damping=1.0, **numbers).rate[-1] == pytest.approx(rate, abs=1e-3)


def test_step_change_takes_its_share_of_the_authority():
    motion = steered(0.1, damping=1.0, authority=1.0, step_time=10.0, step_loss=0.4)
    assert motion.rate[T < 10.0][-1] == pytest.approx(0.1, rel=1e-3)
    assert motion.rate[-1] == pytest.approx(0.06, rel=1e-3)


def test_wave_moves_the_rate_as_a_first_order_filter_of_its_moment():
    motion = steered(0.0, damping=1.0, wave_amplitude=0.1, wave_period=2 * np.pi / 0.8)
    late = motion.rate[T > 12.0]
    assert (late.max() - late.min()) / 2 == pytest.approx(0.1 / np.hypot(1.0, 0.8), rel=1e-2)


def test_current_pulls_the_heading_to_where_its_moment_vanishes():
    motion = steered(0.0, damping=0.5, current_sin=-0.5, current_cos=0.2)
    assert np.tan(motion.angle[-1]) == pytest.approx(0.4, abs=2e-2)


def test_sensor_effects_bend_the_reading_and_not_the_motion():
    plain = steered(0.1)
    bent = steered(0.1, compass_sin=0.1, compass_cos=-0.05, gyro_bias=0.02, gyro_scale=0.1)
    assert bent.angle == pytest.approx(plain.angle + 0.1 * np.sin(plain.angle) - 0.05 * np.cos(plain.angle))
    assert bent.rate == pytest.approx(1.1 * plain.rate + 0.02)


def test_clock_offset_reads_the_motion_early_or_late():
    plain = steered(0.1)
    assert steered(0.1, clock_offset=0.2).rate[:-4] == pytest.approx(plain.rate[4:], abs=1e-6)
    assert steered(0.1, clock_offset=-0.2).rate[4:] == pytest.approx(plain.rate[:-4], abs=1e-6)


def test_a_sloshing_mass_gives_no_energy_to_the_hull():
    inputs = calm(CLOCK)
    inputs[kernel.EVENT, :60] = 0.3
    plan = Maneuver("rest", np.zeros(CLOCK.samples), np.full(CLOCK.samples, kernel.OPEN))
    for share in (0.3, 1.5):
        numbers = Physics(damping=0.02, slosh_moment=share, slosh_omega=2.0, slosh_zeta=0.001, kp=0.0, kd=0.0)
        motion = fly(numbers, CLOCK, plan, inputs)
        first, last = motion.rate[T < 10.0], motion.rate[T > 20.0]
        assert np.abs(last).max() <= np.abs(first).max()


def test_replay_of_a_quiet_run_is_the_run():
    maneuver, numbers = pulses(T), Physics(delay=0.13, servo_tau=0.2, backlash_gap=0.02, quadratic=1.0, roll_by_turn=0.2)
    motion = fly(numbers, CLOCK, maneuver)
    again = replay(numbers, CLOCK, motion, calm(CLOCK))
    assert again.angle == pytest.approx(motion.angle, abs=1e-12)


def test_replay_leaves_the_disturbance_out_from_the_logs_start():
    inputs = calm(CLOCK)
    inputs[kernel.DISTURBANCE] = 0.05
    motion = fly(Physics(), CLOCK, pulses(T), inputs)
    again = replay(Physics(), CLOCK, motion, inputs)
    assert again.angle[0] == pytest.approx(motion.angle[0], abs=1e-4)
    assert np.abs(again.angle - motion.angle).max() > 0.05


def test_a_finer_step_changes_nothing_that_matters():
    numbers = Physics(delay=0.137, servo_tau=0.15, stall_angle=0.12, stall_slope=0.2, quadratic=2.0, crossflow=1.0)
    coarse = fly(numbers, CLOCK, pulses(T), step=0.002)
    fine = fly(numbers, CLOCK, pulses(T), step=0.0005)
    assert coarse.angle == pytest.approx(fine.angle, abs=5e-6)
