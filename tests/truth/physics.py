"""Coefficients of the simulated truth: base model, actuator, hydrodynamics, sensor, and causes that are in no catalogue.

Angle y, rate p, fin d, speed u, time t since the log's start:
    y' = p,  p' = -damping p - stiffness y + authority (d + fin_bend) + trim + effects.
Every field is zero (or infinite) where its effect is absent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class Physics(NamedTuple):
    """All coefficients of one run, SI and radians; floats only, so that it can be passed to the compiled kernel."""

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
    damping_power: float = 1.0
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
    cross_strips: float = 0.0
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


@dataclass(frozen=True)
class HiddenEffect:
    """An effect to recover: its coefficients here, the values that a fit must return, their relative tolerance, the maneuver."""

    name: str
    physics: dict[str, float]
    expected: dict[str, float]
    maneuver: str = "pulses"
    axis: str = "yaw"
    near: float = 0.02


HIDDEN_EFFECTS = (
    HiddenEffect("delay", {"delay": 0.17}, {"delay": 0.17}),
    HiddenEffect("rate_limit", {"max_rate": 0.6}, {"max_rate": 0.6}),
    HiddenEffect("servo_lag", {"servo_tau": 0.22}, {"lag": 0.22}),
    HiddenEffect("backlash", {"backlash_gap": 0.06}, {"gap": 0.06}, "multisine", near=0.05),
    HiddenEffect("deadband", {"deadband_width": 0.04}, {"width": 0.04}, "multisine", near=0.05),
    HiddenEffect("asymmetric_fin", {"asymmetry": 0.2}, {"asymmetry": 0.2}),
    HiddenEffect("stall", {"stall_angle": 0.15, "stall_slope": 0.2},
        {"stall_angle": 0.15, "slope_after": 0.2}, "multisine", near=0.05),
    HiddenEffect("quadratic_damping", {"quadratic": 2.0}, {"quadratic": 2.0}, "zigzag"),
    HiddenEffect("crossflow_drag", {"crossflow": 6.0, "length": 1.8, "cross_damping": 1.1, "cross_rate": 0.99},
        {"crossflow": 6.0, "flow_damping": 1.1, "flow_rate": 0.55}, "multisine", near=0.05),
    HiddenEffect("speed_varying", {"speed_varying": 1.0, "surge_loss": 6.0}, {"speed_share": 1.0}, "circle", near=0.1),
    HiddenEffect("trim_drift", {"drift": 0.0015}, {"drift": 0.09}),
    HiddenEffect("step_change", {"step_time": 20.0, "step_loss": 0.3, "step_moment": 0.03}, {"loss": 0.3, "moment_step": 0.03}),
    HiddenEffect("wave", {"wave_amplitude": 0.05, "wave_period": 6.3, "wave_phase": 0.6}, {"amplitude": 0.05, "period": 6.3}),
    HiddenEffect("sway_coupling", {"cross_damping": 0.7, "cross_rate": 0.9, "cross_moment": -0.5},
           {"cross_damping": 0.7, "cross_rate": 0.45}, "multisine", near=0.05),
    HiddenEffect("current", {"current_sin": 0.03, "current_cos": -0.02},
           {"current_sin": 0.03, "current_cos": -0.02}, "circle", near=0.05),
    HiddenEffect("compass_deviation", {"compass_sin": 0.05, "compass_cos": 0.08},
           {"deviation_sin": 0.05, "deviation_cos": 0.08}, "circle"),
    HiddenEffect("gyro_bias", {"gyro_bias": 0.02}, {"bias": 0.02}),
    HiddenEffect("gyro_scale", {"gyro_scale": 0.15}, {"scale_error": 0.15}),
    HiddenEffect("clock_offset", {"clock_offset": -0.2}, {"offset": 0.2}, near=0.03),
    HiddenEffect("quadratic_damping", {"quadratic": 2.0}, {"quadratic": 2.0}, "stairs", "pitch"),
    HiddenEffect("servo_lag", {"servo_tau": 0.22}, {"lag": 0.22}, axis="pitch"),
    HiddenEffect("heave_coupling", {"cross_damping": 0.7, "cross_rate": 0.9, "cross_moment": -0.5},
           {"cross_damping": 0.7, "cross_rate": 0.45}, "multisine", "pitch", 0.05),
    HiddenEffect("large_angle_righting", {"righting": 1.0}, {"righting_sin": 0.4, "righting_cos": -0.02}, "stairs", "pitch", 0.1),
    HiddenEffect("depth_buoyancy", {"depth_moment": 0.01}, {"depth_moment": 0.01}, "stairs", "pitch"),
)  # fmt: skip
"""The case from which each effect of the catalogue is recovered; tests/recovery flies and fits them."""
