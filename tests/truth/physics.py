"""Numbers of the truth: base model, actuator, hydrodynamics, sensor, and what no catalogue has.

Angle y, rate p, fin d, speed u, time t since the log's start:
    y' = p,  p' = -damping p - stiffness y + authority (d + fin_bend) + trim + effects.
Every field is zero (or infinite) where its effect is absent.
"""

from __future__ import annotations

from typing import NamedTuple


class Physics(NamedTuple):
    """All coefficients of one run, SI and radians; floats only, so that the compiled kernel takes it whole."""

    damping: float = 1.0
    stiffness: float = 0.0
    authority: float = -1.0
    trim: float = 0.0
    fin_bend: float = 0.0
    # actuator, in the order of the path
    delay: float = 0.0
    max_rate: float = 0.0
    falling_rate: float = 1.0
    servo_tau: float = 0.0
    falling_tau: float = 1.0
    servo_omega: float = 0.0
    servo_zeta: float = 0.7
    backlash_gap: float = 0.0
    deadband_width: float = 0.0
    deadband_sticks: float = 0.0
    deadband_middle: float = 0.0
    asymmetry: float = 0.0
    lift_bend: float = 0.0
    stall_angle: float = 0.0
    stall_slope: float = 1.0
    stall_blend: float = 0.0
    stall_drop: float = 0.0
    # hydrodynamics
    quadratic: float = 0.0
    quadratic_exponent: float = 2.0
    crossflow: float = 0.0
    length: float = 1.6
    speed_varying: float = 0.0
    median_speed: float = 1.5
    drift: float = 0.0
    drift_tau: float = 0.0
    step_time: float = 1e9
    step_loss: float = 0.0
    step_moment: float = 0.0
    step_ramp: float = 0.0
    thrust_moment: float = 0.0
    thrust_square: float = 0.0
    wave_amplitude: float = 0.0
    wave_period: float = 5.0
    wave_phase: float = 0.0
    wave_second: float = 0.0
    cross_damping: float = 1.0
    cross_rate: float = 0.0
    cross_fin: float = 0.0
    cross_quadratic: float = 0.0
    cross_moment: float = 0.0
    roll_moment: float = 0.0
    roll_rate_moment: float = 0.0
    current_sin: float = 0.0
    current_cos: float = 0.0
    current_twice: float = 0.0
    current_turn: float = 0.0
    righting: float = 0.0
    depth_moment: float = 0.0
    depth_square: float = 0.0
    depth_reference: float = 0.0
    speed_moment: float = 0.0
    speed_reference: float = 1.5
    # sensor
    compass_sin: float = 0.0
    compass_cos: float = 0.0
    compass_second: float = 0.0
    gyro_bias: float = 0.0
    gyro_scale: float = 0.0
    gyro_cubic: float = 0.0
    clock_offset: float = 0.0
    clock_drift: float = 0.0
    # in no catalogue
    memory_moment: float = 0.0
    memory_tau: float = 5.0
    slosh_moment: float = 0.0
    slosh_omega: float = 2.0
    slosh_zeta: float = 0.05
    # the motions that are not of this axis
    roll_omega: float = 1.2
    roll_zeta: float = 0.3
    roll_by_turn: float = 0.0
    nominal_speed: float = 1.5
    nominal_thrust: float = 50.0
    reference_thrust: float = 50.0
    surge_tau: float = 4.0
    surge_loss: float = 0.0
    # the pilot
    kp: float = 0.5
    kd: float = 0.3
    fin_limit: float = 0.35
    fin_trim: float = 0.0
    zigzag_fin: float = 0.17
    zigzag_angle: float = 0.17
