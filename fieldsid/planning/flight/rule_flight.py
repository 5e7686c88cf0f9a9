"""Simulation of many operating points at once: for a list of fin angles, or for a maneuver that is a rule (`maneuvers.fly`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np

from fieldsid.dynamics.assemble import KernelInputs, assemble, fin_path
from fieldsid.dynamics.free_run import command_record
from fieldsid.dynamics.nonlinear_kernel import over_interval
from fieldsid.maneuvers import Autopilot, Flight, Limits, Maneuver, Parameters, Schedule, fly, steer
from fieldsid.models.hull import CONSTANTS, DRIVES, FIN, MOMENT_END, MOMENT_START, kinds_of, named
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit
from fieldsid.planning.flight.operating_point import OperatingPoint


@dataclass(frozen=True, slots=True)
class Response:
    """The response of one operating point: time (n,) s, fin command about trim rad, angle rad, rate rad/s (n,)."""

    time: FloatArray
    command: FloatArray
    angle: FloatArray
    rate: FloatArray


@inner
def add_fin(drive: FloatArray, i: int, start: float, end: float, push_start: float, push_end: float) -> None:
    """Add a fin, with angles (rad) and moments per rad (1/s^2) at both ends of interval i, to a drive without a fin."""
    drive[i, MOMENT_START] += push_start * start
    drive[i, MOMENT_END] += push_end * end
    drive[i, FIN] = 0.5 * (start + end)


@jit
def closed_loop(
    steps: FloatArray, drive: FloatArray, c: FloatArray, pieces: int, fins: FloatArray, off: FloatArray,
    push: FloatArray, gains: FloatArray, limits: FloatArray, command: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Fill command (n,) and out (n, 3) with fin command, and angle, rate and cross state from rest.

    fins (n,): fin angle about trim, NaN where the autopilot steers. off (n-1, 2): fin angle minus command at both ends of each
    interval. push (n-1, 2): moment per rad at both ends. gains (3,): angle gain, rate gain and fin limit of the autopilot.
    limits (4,): lowest and highest command, rate limit, trim fin.
    """
    n, state, last = fins.shape[0], (0.0, 0.0, 0.0), 0.0
    k, kinds = named(c), kinds_of(c)
    for i in range(n):
        out[i, 0], out[i, 1], out[i, 2] = state
        fin = steer(fins[i], state[0], state[1], last, gains, limits[2] * steps[min(i, n - 2)], limits[0], limits[1])
        command[i] = fin
        last = fin
        if i == n - 1:
            break
        add_fin(drive, i, limits[3] + fin + off[i, 0], limits[3] + fin + off[i, 1], push[i, 0], push[i, 1])
        state = over_interval(k, kinds, drive, i, steps[i], pieces, -0.5 * steps[i], state)


@lru_cache(maxsize=16)
def prepared(scene: OperatingPoint, count: int, rate_hz: float) -> tuple[KernelInputs, FloatArray]:
    """Return the kernel inputs of an operating point over `count` samples without a fin, and its moments per rad, (n-1, 2).

    These are the moments of one rad of fin at both ends of each interval, in 1/s^2.
    """
    idle = scene.record(np.arange(count) / rate_hz, np.zeros(count))
    arrays = assemble(idle, scene.effects, replace(scene.base, authority=0.0), scene.values, scene.scale)
    factor = np.ones(count) if arrays.terms.authority_factor is None else arrays.terms.authority_factor
    return arrays, scene.base.authority * np.column_stack([factor[:-1], factor[1:]])


T = TypeVar("T")
ACTUATOR_ROUNDS = 4
"""Iterations in which the path of the fin behind the actuator effects is fed back into the simulated loop."""


@jit
def advance_all(
    step: float, at: int, drive: FloatArray, c: FloatArray, pieces: int, push: FloatArray, fin: FloatArray, trim: FloatArray,
    off: FloatArray, state: FloatArray, moved: FloatArray,
) -> None:  # fmt: skip
    """Advance states (m, 3) by the interval `at` with fins (m,) about trim (m,), and fill moved (2, m) with angles and rates.

    drive (m, n-1, 6) without the fin; push (m, n-1, 2) and off (m, n-1, 2) as in `closed_loop`.
    """
    now = np.empty((1, drive.shape[2]))
    for i in range(state.shape[0]):
        for j in range(drive.shape[2]):
            now[0, j] = drive[i, at, j]
        angle = trim[i] + fin[i]
        add_fin(now, 0, angle + off[i, at, 0], angle + off[i, at, 1], push[i, at, 0], push[i, at, 1])
        before = (state[i, 0], state[i, 1], state[i, 2])
        state[i, 0], state[i, 1], state[i, 2] = over_interval(
            named(c[i]), kinds_of(c[i]), now, 0, step, pieces, -0.5 * step, before
        )
        moved[0, i], moved[1, i] = state[i, 0], state[i, 1]


@dataclass(slots=True)
class OperatingPointPlant:
    """Operating points as the plant of `maneuvers.fly`; `off` (m, n-1, 2) is each fin angle minus its command."""

    drive: FloatArray
    constants: FloatArray
    pieces: int
    push: FloatArray
    trim: FloatArray
    off: FloatArray
    state: FloatArray
    at: int = 0

    @property
    def size(self) -> int:
        """Number of operating points."""
        return int(self.trim.size)

    def advance(self, fin: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
        """Advance by `step` s with constant fins (m,) about trim; return angles and rates (m,)."""
        at, moved = min(self.at, self.drive.shape[1] - 1), np.empty((2, self.size))
        advance_all(
            step, at, self.drive, self.constants, self.pieces, self.push, fin, self.trim, self.off, self.state, moved
        )  # fmt: skip
        self.at += 1
        return moved[0], moved[1]

    def first(self, count: int) -> OperatingPointPlant:
        """Return the first operating points only, at rest."""
        part = slice(0, count)
        return OperatingPointPlant(
            self.drive[part], self.constants[part], self.pieces, self.push[part], self.trim[part], self.off[part],
            np.zeros((count, 3)),
        )  # fmt: skip

    def again(self, off: FloatArray) -> OperatingPointPlant:
        """Return the plant at rest at its start, with another `off`."""
        return replace(self, off=off, state=np.zeros((self.size, 3)), at=0)


def plant_of(scenes: Sequence[OperatingPoint], n: int, rate_hz: float, moments: FloatArray | None) -> OperatingPointPlant:
    """Return operating points at rest as one plant over n samples; moments (m, n) rad/s^2 are disturbances."""
    count = len(scenes)
    drive, push = np.empty((count, n - 1, len(DRIVES))), np.empty((count, n - 1, 2))
    constants = np.empty((count, len(CONSTANTS)))
    pieces = 1
    for i, scene in enumerate(scenes):
        ready, push[i] = prepared(scene, n, rate_hz)
        drive[i], constants[i] = ready.drive, ready.constants
        pieces = max(pieces, ready.pieces)
    if moments is not None:
        drive[:, :, MOMENT_START] += moments[:, :-1]
        drive[:, :, MOMENT_END] += moments[:, 1:]
    trim = np.array([s.trim_fin for s in scenes])
    return OperatingPointPlant(drive, constants, pieces, push, trim, np.zeros((count, n - 1, 2)), np.zeros((count, 3)))


def fly_fins(
    scenes: Sequence[OperatingPoint],
    plant: OperatingPointPlant,
    time: FloatArray,
    fins: FloatArray,
    limits: Limits,
    autopilot: Autopilot,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return command, angle and rate (n, m) of operating points from rest; fins (n,) rad about trim, NaN for the autopilot.

    `plant` is that of the operating points, from `plant_of`. Actuator effects transform the whole command path, so that the loop
    is simulated in a few iterations (`_through_actuators`).
    """
    command, angle, rate = (np.empty((plant.size, time.size)) for _ in range(3))
    bounds = np.column_stack([*limits.about(plant.trim), np.full(plant.size, limits.fin_rate), plant.trim])
    gains, steps, out = autopilot.gains, np.diff(time), np.empty((time.size, 3))

    def flown(off: FloatArray) -> FloatArray:
        for i in range(plant.size):
            closed_loop(
                steps, plant.drive[i].copy(), plant.constants[i], plant.pieces, fins, off[i], plant.push[i], gains, bounds[i],
                command[i], out,
            )  # fmt: skip
            angle[i], rate[i] = out[:, 0], out[:, 1]
        return command.T

    _through_actuators(scenes, time, plant.off, flown, lambda commands: commands)
    return command.T, angle.T, rate.T


def fly_operating_points(
    scenes: Sequence[OperatingPoint],
    maneuver: Maneuver,
    parameters: Parameters,
    *,
    limits: Limits,
    autopilot: Autopilot,
    schedule: Schedule,
    moments: FloatArray | None = None,
) -> Flight:
    """Return the simulation of a maneuver from rest with actuator effects; moments (m, k) rad/s^2 are disturbances."""
    longest = schedule.run_up + maneuver.duration(parameters) + schedule.recover
    time = np.arange(round(longest * schedule.rate_hz) + 2) / schedule.rate_hz
    if moments is not None:
        moments = np.pad(moments, ((0, 0), (0, max(0, time.size - moments.shape[1]))), mode="edge")[:, : time.size]
    plant = plant_of(scenes, time.size, schedule.rate_hz, moments)

    def flown(off: FloatArray) -> Flight:
        return fly(maneuver, parameters, plant.again(off), limits=limits, autopilot=autopilot, schedule=schedule)

    return _through_actuators(scenes, time, plant.off, flown, lambda flight: flight.fin)


def _through_actuators(
    scenes: Sequence[OperatingPoint],
    time: FloatArray,
    off: FloatArray,
    flown: Callable[[FloatArray], T],
    commands: Callable[[T], FloatArray],
) -> T:
    """Return the last of ACTUATOR_ROUNDS simulations; each has the fin paths for the commands (k, m) of the previous one.

    off (m, n-1, 2) is each fin angle minus its command at both ends of every interval of `time` (n,), in the first simulation; it
    is zero after the end of a flight.
    """
    has_actuator_effect = any(e.fin is not None for s in scenes for e in s.effects)
    for remaining in reversed(range(ACTUATOR_ROUNDS if has_actuator_effect else 1)):
        found = flown(off)
        if remaining:
            command, before, off = commands(found), off, np.zeros_like(off)
            idle = _idle(scenes, time[: command.shape[0]])
            for i, scene in enumerate(scenes):
                fin, constant = command[:, i] + scene.trim_fin, command[:-1, i] + scene.trim_fin
                path = fin_path(idle[scene.speed].with_fin(fin), scene.effects, scene.values)
                off[i, : constant.size] = np.column_stack([path.start - constant, path.end - constant])
            if np.array_equal(off, before):  # converged
                break
    return found


def _idle(scenes: Sequence[OperatingPoint], time: FloatArray) -> dict[float, Record]:
    """Return a record with a zero command at times (n,) s for each speed of the operating points."""
    none = np.zeros(time.size)
    return {speed: command_record(scenes[0].axis, time, none, speed=speed) for speed in {s.speed for s in scenes}}
