"""One hull scaled in time to an aircraft, a REMUS, a barge and a ship: yaw with time constants of 0.2 to 60 s.

All are the same vehicle except for the unit of time T, the time constant of the turn: damping 1 / T, authority and moments in
1 / T^2, rates in 1 / T, maneuvers and samples in T. Angles do not scale. So each must give the same diagnosis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truth import kernel, maneuvers
from truth.noise import Clock, calm, white
from truth.physics import Physics
from truth.simple import fly

SAMPLES_A_TIME_CONSTANT, RUN = 20, 70.0
"""Number of samples in T, and the duration of a run in T."""
FIN, ANGLE_NOISE, RATE_NOISE = 0.26, 0.004, 0.006
"""Fin amplitude in rad; noise of the heading in rad and of the rate in rad / T."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of vehicle: the time constant of its turn in s, and its speed in m/s."""

    name: str
    time_constant: float
    speed: float


KINDS = (Kind("aircraft", 0.2, 18.0), Kind("remus", 1.0, 1.5), Kind("barge", 12.0, 2.0), Kind("ship", 60.0, 7.5))
HIDDEN = {
    "": {},
    "quadratic_damping": {"quadratic": 3.0},
    "sway_coupling": {"cross_damping": 0.7, "cross_rate": 0.6, "cross_moment": -0.9},
}
"""Hidden effects in units of T: none, quadratic damping (1/rad), sway coupling (1/T each)."""
POWERS = {"quadratic": 0, "cross_damping": -1, "cross_rate": -1, "cross_moment": -1}


def physics_of(kind: Kind, effect: str) -> Physics:
    """Return the physics (SI) of a kind with a hidden effect."""
    t = kind.time_constant
    hidden = {name: value * t ** POWERS[name] for name, value in HIDDEN[effect].items()}
    return Physics(
        damping=1.0 / t, authority=-0.9 / t**2, trim=-0.005 / t**2, nominal_speed=kind.speed, median_speed=kind.speed,
        surge_tau=4.0 * t, kp=0.9, kd=0.4 * t, roll_omega=1.2 / t, fin_limit=0.35, **hidden,
    )  # fmt: skip


def plans(t: float, time: np.ndarray) -> dict[str, maneuvers.Maneuver]:
    """Return the maneuvers for a time constant t: pulses and zig-zags for training, others of other sizes for validation."""
    pulses = {"width": 2.0 * t, "start": 2.0 * t, "recovery": 9.0 * t}
    zigzag = {"start": 2.0 * t, "end_rest": 4.0 * t}
    return {
        "pulses": maneuvers.pulses(time, FIN, 0.15, **pulses),
        "zigzag": maneuvers.zigzag(time, 0.2, 0.3, **zigzag),
        "zigzag_large": maneuvers.zigzag(time, FIN, 0.5, **zigzag),
        "pulses_small": maneuvers.pulses(time, 0.2, 0.1, polarity=-1.0, **pulses),
        "zigzag_unseen": maneuvers.zigzag(time, 0.23, 0.4, **zigzag),
    }


TRAINING = ("pulses", "zigzag", "zigzag_large")


def logs_of(kind: Kind, effect: str, seed: int = 0) -> dict[str, dict[str, np.ndarray]]:
    """Return the logs of a kind with a hidden effect, by maneuver, with canonical columns."""
    t = kind.time_constant
    clock = Clock(t / SAMPLES_A_TIME_CONSTANT, round(RUN * SAMPLES_A_TIME_CONSTANT))
    physics, rng, logs = physics_of(kind, effect), np.random.default_rng(seed), {}
    for name, plan in plans(t, clock.time).items():
        inputs = calm(clock, physics.nominal_thrust)
        inputs[kernel.ANGLE_NOISE] = white(rng, clock.total, ANGLE_NOISE)
        inputs[kernel.RATE_NOISE] = white(rng, clock.total, RATE_NOISE / t)
        motion = fly(physics, clock, plan, inputs, step=t / 200.0)
        logs[name] = {
            "time_s": motion.time,
            "yaw_rad": motion.angle + clock.logged(inputs[kernel.ANGLE_NOISE]),
            "yaw_rate_rad_s": motion.rate + clock.logged(inputs[kernel.RATE_NOISE]),
            "rudder_rad": motion.command.copy(),
            "surge_m_s": motion.surge + 0.005 * kind.speed * rng.standard_normal(motion.time.size),
        }
    return logs
