"""Every effect as a function of one strength, 0 absent and 1 very large. The shape is random, the strength scales it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Setting:
    """The base model at the reference speed, by which the sizes of the effects are scaled.

    `moment`: that of a fin of 0.26 rad (rad/s^2); `rate`: the yaw (pitch) rate that it causes (rad/s).
    """

    pitching: bool
    damping: float
    stiffness: float
    authority: float
    speed: float
    thrust: float
    rate: float
    runs: int

    @property
    def moment(self) -> float:
        return abs(self.authority) * 0.26


Apply = Callable[[float, float, int], dict[str, float]]
"""(strength, speed / reference, run) -> fields of Physics; names in SCENE go to the scene instead."""
SCENE = ("thrust_swing", "roll_push", "depth_spread", "authority_times")


def _sign(rng):
    return float(rng.choice([-1.0, 1.0]))


def _fixed(**per_unit: float) -> Apply:
    return lambda s, _u, _i: {name: value * s for name, value in per_unit.items()}


def delay(rng, _k):
    return _fixed(delay=0.6)


def rate_limit(rng, _k):
    return lambda s, _u, _i: {"max_rate": 0.12 / s}


def servo_lag(rng, _k):
    return _fixed(servo_tau=0.7)


def backlash(rng, _k):
    return _fixed(backlash_gap=0.2)


def deadband(rng, _k):
    return _fixed(deadband_width=0.12)


def asymmetric_fin(rng, _k):
    return _fixed(asymmetry=_sign(rng) * 0.6)


def stall(rng, _k):
    angle = rng.uniform(0.10, 0.17)
    return lambda s, _u, _i: {"stall_angle": angle, "stall_slope": 1.0 - 1.7 * s}


def drag_size(k):
    """Return the quadratic damping (1/rad) of strength one; that of the REMUS in pitch is 22, and few hulls have more."""
    return min(3.0 * k.damping / k.rate, 8.0)


def quadratic_damping(rng, k):
    if not k.pitching and rng.random() < 0.12:  # an unstable hull, limited by its quadratic damping only
        values = {"damping": -rng.uniform(0.05, 0.15), "quadratic": rng.uniform(0.5, 1.5) * k.damping / k.rate}
        return lambda _s, _u, _i: dict(values)
    return _fixed(quadratic=drag_size(k))


def crossflow_drag(rng, k):
    length, drift, e = rng.uniform(1.2, 2.5), rng.uniform(0.3, 0.8), rng.uniform(0.5, 1.5)
    size = drag_size(k)

    def apply(s, u, _i):
        return {"crossflow": size * s, "length": length, "cross_damping": e * u, "cross_rate": drift * length * e * u}

    return apply


def speed_varying(rng, _k):
    loss = rng.uniform(0.0, 1.0)
    return lambda s, _u, _i: {"speed_varying": 1.0, "thrust_swing": 0.75 * s, "surge_loss": loss * s}


def trim_drift(rng, k):
    return _fixed(drift=_sign(rng) * 0.8 * k.moment / 60.0)


def step_change(rng, k):
    times = rng.uniform(12.0, 42.0, k.runs)
    if rng.random() < 0.3:
        times[rng.integers(0, 3)] = 1e9
    loss, moment = rng.uniform(0.0, 0.6), _sign(rng) * rng.uniform(0.1, 0.4) * k.moment

    def apply(s, _u, i):
        return {"step_time": times[i], "step_loss": min(loss * s, 0.9), "step_moment": moment * s}

    return apply


def prop_moment(rng, k):
    size, swing = _sign(rng) * 1.0 * k.moment / k.thrust, rng.uniform(0.2, 0.4)

    def apply(s, u, _i):
        # cancelled in yaw by the fin, whose moment is proportional to u^2 as the thrust is, in pitch by a weight
        held = {"trim": -size * s * k.thrust} if k.pitching else {"fin_trim": -size * s * k.thrust * u * u}
        return {"thrust_moment": size * s, "thrust_swing": swing} | held

    return apply


def wave(rng, k):
    phases, period = rng.uniform(0, 2 * np.pi, k.runs), rng.uniform(3.0, 12.0)

    def apply(s, _u, i):
        return {"wave_amplitude": 0.5 * k.moment * s, "wave_period": period, "wave_phase": phases[i]}

    return apply


def cross_coupling(rng, k):
    """Sway or heave: v' = -a11 v - a12 r + b1 d, r' = ... - a21 v, with a11, a12, a21 ~ u and b1 ~ u^2."""
    e, a12 = rng.uniform(0.4, 2.0), rng.uniform(0.3, 0.9)
    share = -0.85 * k.damping if rng.random() < 0.7 else 2.5 * (k.damping + np.sqrt(k.stiffness))
    b1 = rng.uniform(-0.3, 0.5) * k.authority / (k.damping + np.sqrt(k.stiffness)) * a12

    def apply(s, u, _i):
        a21 = -share * s * e / a12
        return {"cross_damping": e * u, "cross_rate": a12 * u, "cross_fin": b1 * u * u, "cross_moment": a21 * u}

    return apply


def roll_coupling(rng, k):
    size, heel = _sign(rng) * 6.0 * k.moment, rng.uniform(0.0, 0.4)
    push = rng.uniform(0.05, 0.12)
    return lambda s, _u, _i: {"roll_moment": size * s, "roll_by_turn": heel, "roll_push": push}


def current(rng, k):
    a = rng.uniform(0, 2 * np.pi)
    return _fixed(current_sin=0.4 * k.moment * np.sin(a), current_cos=0.4 * k.moment * np.cos(a))


def large_angle_righting(rng, k):
    trim = _sign(rng) * rng.uniform(0.0, 0.12) * k.stiffness
    return lambda s, _u, _i: {"righting": 1.0, "trim": trim, "authority_times": 0.6 + 2.2 * s}


def depth_buoyancy(rng, k):
    size = min(0.5 * k.moment, 0.6 * k.damping * k.stiffness / k.speed)
    return lambda s, _u, _i: {"depth_moment": size * s, "depth_reference": 6.0, "depth_spread": 1.0}


def speed_moment(rng, k):
    size, swing = _sign(rng) * 0.7 * k.moment / k.speed**2, rng.uniform(0.15, 0.4)
    return lambda s, _u, _i: {"speed_moment": size * s, "speed_reference": k.speed, "thrust_swing": swing}


def compass_deviation(rng, _k):
    a = rng.uniform(0, 2 * np.pi)
    return _fixed(compass_sin=0.25 * np.sin(a), compass_cos=0.25 * np.cos(a))


def gyro_bias(rng, _k):
    return _fixed(gyro_bias=_sign(rng) * 0.06)


def gyro_scale(rng, _k):
    return _fixed(gyro_scale=_sign(rng) * 0.4)


def clock_offset(rng, _k):
    return _fixed(clock_offset=_sign(rng) * 0.5)


BOTH = (
    delay, rate_limit, servo_lag, backlash, deadband, asymmetric_fin, stall, quadratic_damping, crossflow_drag, speed_varying,
    trim_drift, step_change, prop_moment, wave, gyro_bias, gyro_scale, clock_offset,
)  # fmt: skip
YAW = {f.__name__: f for f in (*BOTH, roll_coupling, current, compass_deviation)} | {"sway_coupling": cross_coupling}
PITCH = {f.__name__: f for f in (*BOTH, large_angle_righting, depth_buoyancy, speed_moment)} | {"heave_coupling": cross_coupling}
LARGEST = {
    "stall": 1.0, "delay": 1.2, "clock_offset": 1.15, "step_change": 1.5, "large_angle_righting": 0.7, "speed_varying": 1.1,
    "sway_coupling": 1.0, "heave_coupling": 1.0, "asymmetric_fin": 1.4, "depth_buoyancy": 1.0,
    "gyro_scale": 1.2, "gyro_bias": 1.5, "servo_lag": 1.2, "rate_limit": 1.5, "backlash": 1.0, "deadband": 1.2,
    "compass_deviation": 1.5, "wave": 1.5,
}  # fmt: skip
"""Largest strength that is still physical; that of effects not listed is 3."""


def reshaped(name: str, apply: Apply, setting: Setting, rng: np.random.Generator) -> Apply:
    """Return the effect in a form that is not the textbook's; raises KeyError where there is none."""

    def servo(values):
        return {"servo_tau": 0.0, "servo_omega": 1.4 / values["servo_tau"], "servo_zeta": 0.7}

    def powered(values):
        return {"quadratic_exponent": power, "quadratic": values["quadratic"] * setting.rate ** (2.0 - power)}

    def current(values):
        size = np.hypot(values["current_sin"], values["current_cos"])
        return {"current_turn": 0.02} if second else {"current_twice": 0.5 * size}

    power = float(rng.choice([1.5, 1.7, 2.4, 2.8])) if name == "quadratic_damping" else 2.0
    second = bool(rng.random() < 0.5)
    forms = {
        "stall": lambda _: {"stall_drop": 0.2} if second else {"stall_blend": 0.04},
        "servo_lag": lambda v: {"falling_tau": 0.5} if second else servo(v),
        "rate_limit": lambda _: {"falling_rate": 1.8},
        "asymmetric_fin": lambda v: {"asymmetry": 0.3 * v["asymmetry"], "lift_bend": 3.0 * v["asymmetry"]},
        "prop_moment": lambda v: {"thrust_square": 2.0 * v["thrust_moment"] / setting.thrust},
        "roll_coupling": lambda v: {"roll_rate_moment": 0.8 * v["roll_moment"]},
        "depth_buoyancy": lambda v: {"depth_square": 0.4 * v["depth_moment"]},
        "gyro_scale": lambda v: {"gyro_cubic": 0.8 * v["gyro_scale"] / setting.rate**2},
        "clock_offset": lambda v: {"clock_drift": 0.01 * v["clock_offset"]},
        "current": current,
        "quadratic_damping": powered,
        "deadband": lambda v: {"deadband_middle": 0.5 * v["deadband_width"]} if second else {"deadband_sticks": 1.0},
        "sway_coupling": lambda _: {"cross_quadratic": 1.0},
        "heave_coupling": lambda _: {"cross_quadratic": 1.0},
        "trim_drift": lambda v: {"drift_tau": 30.0, "drift": 1.5 * v["drift"]},
        "step_change": lambda _: {"step_ramp": 2.5},
        "wave": lambda _: {"wave_second": 0.4},
        "compass_deviation": lambda v: {"compass_second": 0.25 * np.hypot(v["compass_sin"], v["compass_cos"])},
    }
    change = forms[name]

    def bent(s, u, i):
        values = apply(s, u, i)
        return values | change(values)

    return bent


RESHAPED = (
    "stall", "servo_lag", "quadratic_damping", "deadband", "trim_drift", "step_change", "wave", "rate_limit", "asymmetric_fin",
    "prop_moment", "gyro_scale", "clock_offset",
)  # fmt: skip
