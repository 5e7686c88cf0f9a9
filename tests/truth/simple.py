"""Simulate the one-axis truth with its effects, and the noise-free response that an ideal model would give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truth import kernel
from truth.noise import Clock, calm
from truth.physics import Physics

FINE_S = 0.002
"""Longest step of the integration, s."""


@dataclass(frozen=True, slots=True)
class Motion:
    """A flown run at the log's samples (n,); angle and rate have the sensors' systematic errors, but no noise.

    `whole_command` (total,) and `known` (3, total), which is roll, depth and surge, include the time around the log.
    """

    time: np.ndarray
    command: np.ndarray
    fin: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    cross: np.ndarray
    roll: np.ndarray
    roll_rate: np.ndarray
    depth: np.ndarray
    surge: np.ndarray
    whole_command: np.ndarray
    known: np.ndarray


def start_state(physics, angle, depth, thrust):
    """Return a state (10,) that is at rest at an angle, except for the trim moment."""
    y = np.zeros(kernel.STATES)
    y[kernel.ANGLE], y[kernel.DEPTH] = angle, depth
    y[kernel.SURGE] = physics.nominal_speed * np.sqrt(max(thrust, 0.0) / physics.nominal_thrust)
    return y


def fly(physics, clock, maneuver, inputs=None, *, pitching=False, angle=0.0, depth=2.0, step=FINE_S):
    """Fly a maneuver (n,) with the pilot in the loop; inputs (9, total): as `noise.calm` returns them."""
    inputs = calm(clock, physics.nominal_thrust) if inputs is None else inputs
    physics = physics._replace(**maneuver.settings)
    plan, mode = np.zeros(clock.total), np.full(clock.total, kernel.HOLD)
    plan[clock.pre : clock.pre + clock.samples], mode[clock.pre : clock.pre + clock.samples] = maneuver.command, maneuver.mode
    start = start_state(physics, angle, depth, inputs[kernel.THRUST, 0])
    return _run(physics, clock, start, plan, mode, inputs, np.zeros((3, 0)), pitching, step)


def replay(physics, clock, motion, inputs, *, pitching=False, angle=0.0, depth=2.0, step=FINE_S):
    """Return the response to the flown command without noise and, from the start of the log, without disturbance.

    Roll, depth and surge are those of `motion`; the events in the other rows of the inputs are part of the truth.
    """
    quiet = inputs.copy()
    quiet[kernel.DISTURBANCE, clock.pre :] = 0.0
    mode = np.full(clock.total, kernel.OPEN)
    start = start_state(physics, angle, depth, inputs[kernel.THRUST, 0])
    physics = physics._replace(fin_limit=10.0, fin_trim=0.0)
    return _run(physics, clock, start, motion.whole_command, mode, quiet, motion.known, pitching, step)


def _run(physics, clock, start, plan, mode, inputs, known, pitching, step):
    steps = max(1, int(np.ceil(clock.sample / step - 1e-9)))
    command, fine, states = kernel.fly(
        physics, start, plan, mode, inputs, known, clock.sample, steps, -clock.pre * clock.sample, pitching
    )
    fine_time = np.arange(fine.shape[0]) * (clock.sample / steps) - clock.pre * clock.sample
    at = clock.time + physics.clock_offset + physics.clock_drift * (clock.time - 0.5 * clock.time[-1])
    angle, rate = np.interp(at, fine_time, fine[:, 0]), np.interp(at, fine_time, fine[:, 1])
    bent = physics.compass_sin * np.sin(angle) + physics.compass_cos * np.cos(angle) + physics.compass_second * np.sin(2 * angle)
    part = {name: clock.logged(states[:, i]) for name, i in _STATES.items()}
    return Motion(
        time=clock.time,
        command=clock.logged(command),
        fin=clock.logged(fine[::steps, 2]),
        angle=angle + bent,
        rate=rate * (1.0 + physics.gyro_scale + physics.gyro_cubic * rate**2) + physics.gyro_bias,
        whole_command=command,
        known=states[:, [kernel.ROLL, kernel.DEPTH, kernel.SURGE]].T.copy(),
        **part,
    )


_STATES = {
    "cross": kernel.CROSS,
    "roll": kernel.ROLL,
    "roll_rate": kernel.ROLL_RATE,
    "depth": kernel.DEPTH,
    "surge": kernel.SURGE,
}

__all__ = ["Clock", "Motion", "Physics", "fly", "replay", "start_state"]
