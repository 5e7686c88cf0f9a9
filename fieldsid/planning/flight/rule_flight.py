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
    at: int, steps: FloatArray, drive: FloatArray, c: FloatArray, pieces: int, fins: FloatArray, off: FloatArray,
    push: FloatArray, gains: FloatArray, limits: FloatArray, state: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Advance m operating points by k samples from the sample `at` on; fill out (3, k, m) with fin command, angle and rate.

    state (m, 4): angle, rate, cross state, last command, of which the new ones are stored. fins (k, m), or (k, 1) for all alike:
    fin angle about trim, NaN where the autopilot steers. drive (m, n-1, 6) is without the fin. off (m, n-1, 2): fin angle minus
    command at both ends of each interval. push (m, n-1, 2): moment per rad at both ends. gains (3,): angle gain, rate gain and
    fin limit of the autopilot. limits (m, 4): lowest and highest command, rate limit, trim fin. The last sample begins no
    interval.
    """
    now = np.empty((1, drive.shape[2]))
    for v in range(state.shape[0]):
        k, kinds, own = named(c[v]), kinds_of(c[v]), v % fins.shape[1]
        motion, last = (state[v, 0], state[v, 1], state[v, 2]), state[v, 3]
        for j in range(fins.shape[0]):
            i = at + j
            step = steps[min(i, steps.shape[0] - 1)]
            last = steer(fins[j, own], motion[0], motion[1], last, gains, limits[v, 2] * step, limits[v, 0], limits[v, 1])
            out[0, j, v], out[1, j, v], out[2, j, v] = last, motion[0], motion[1]
            if i == steps.shape[0]:
                break
            for l in range(drive.shape[2]):
                now[0, l] = drive[v, i, l]
            fin = limits[v, 3] + last
            add_fin(now, 0, fin + off[v, i, 0], fin + off[v, i, 1], push[v, i, 0], push[v, i, 1])
            motion = over_interval(k, kinds, now, 0, step, pieces, -0.5 * step, motion)
        state[v, 0], state[v, 1], state[v, 2] = motion
        state[v, 3] = last


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


@dataclass(slots=True)
class OperatingPointPlant:
    """Operating points as the plant of `maneuvers.fly`, with the arrays of `closed_loop`; `free` are its limits without any."""

    scenes: Sequence[OperatingPoint]
    steps: FloatArray
    drive: FloatArray
    constants: FloatArray
    pieces: int
    push: FloatArray
    free: FloatArray
    off: FloatArray
    state: FloatArray
    at: int = 0

    @property
    def size(self) -> int:
        """Number of operating points."""
        return len(self.scenes)

    @property
    def trim(self) -> FloatArray:
        """Fin angles of straight flight (m,), rad."""
        trim: FloatArray = self.free[:, 3]
        return trim

    def flown(self, fins: FloatArray, gains: FloatArray, limits: FloatArray) -> FloatArray:
        """Advance by the samples of fins (k, m or 1); return command, angle and rate at them, (3, k, m), see `closed_loop`."""
        out = np.empty((3, fins.shape[0], self.size))
        at = min(self.at, self.steps.size - 1)
        closed_loop(
            at, self.steps, self.drive, self.constants, self.pieces, fins, self.off, self.push, gains, limits, self.state, out
        )
        self.at += fins.shape[0]
        return out

    def advance(self, fin: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002 - the plant has its steps
        """Advance by one sample with constant fins (m,) about trim; return angles and rates (m,)."""
        self.flown(fin[None, :], np.zeros(3), self.free)
        return self.state[:, 0].copy(), self.state[:, 1].copy()

    def first(self, count: int) -> OperatingPointPlant:
        """Return the first operating points only, at rest."""
        own = {name: getattr(self, name)[:count] for name in ("scenes", "drive", "constants", "push", "free", "off")}
        return replace(self, **own, state=np.zeros((count, 4)), at=0)

    def again(self, off: FloatArray) -> OperatingPointPlant:
        """Return the plant at rest at its start, with another `off`."""
        return replace(self, off=off, state=np.zeros((self.size, 4)), at=0)


def plant_of(scenes: Sequence[OperatingPoint], n: int, rate_hz: float, moments: FloatArray | None = None) -> OperatingPointPlant:
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
    steps, free = np.diff(np.arange(n) / rate_hz), np.array([[-np.inf, np.inf, np.inf, s.trim_fin] for s in scenes])
    off = np.zeros((count, n - 1, 2))
    return OperatingPointPlant(scenes, steps, drive, constants, pieces, push, free, off, np.zeros((count, 4)))


def fly_fins(plant: OperatingPointPlant, fins: FloatArray, limits: Limits, autopilot: Autopilot) -> FloatArray:
    """Return command, angle and rate, (3, n, m), of a plant from rest; fins (n,) rad about trim, NaN for the autopilot.

    Actuator effects transform the whole command path, so that the loop is simulated in a few iterations (`_through_actuators`).
    """
    rows, gains = limits.rows(plant.trim), autopilot.gains
    return _through_actuators(plant, lambda at_rest: at_rest.flown(fins[:, None], gains, rows), lambda found: found[0])


def fly_maneuver(
    plant: OperatingPointPlant,
    maneuver: Maneuver,
    parameters: Parameters,
    *,
    limits: Limits,
    autopilot: Autopilot,
    schedule: Schedule,
) -> Flight:
    """Return the simulation of a maneuver from rest with actuator effects, for at most the samples of the plant."""

    def flown(at_rest: OperatingPointPlant) -> Flight:
        samples = at_rest.steps.size + 1
        return fly(maneuver, parameters, at_rest, limits=limits, autopilot=autopilot, schedule=schedule, samples=samples)

    return _through_actuators(plant, flown, lambda flight: flight.fin)


def _through_actuators(
    plant: OperatingPointPlant, flown: Callable[[OperatingPointPlant], T], commands: Callable[[T], FloatArray]
) -> T:
    """Return the last of ACTUATOR_ROUNDS simulations of a plant; each has the fin paths for the commands (k, m) of the last one.

    The difference of fin angle and command is zero in the first simulation, and after the end of a flight.
    """
    scenes, off = plant.scenes, plant.off
    has_actuator_effect = any(e.fin is not None for s in scenes for e in s.effects)
    for remaining in reversed(range(ACTUATOR_ROUNDS if has_actuator_effect else 1)):
        found = flown(plant.again(off))
        if remaining:
            command, before, off = commands(found), off, np.zeros_like(off)
            idle = _idle(scenes, np.append(0.0, np.cumsum(plant.steps))[: command.shape[0]])
            for scene, fin, beside in zip(scenes, np.ascontiguousarray((command + plant.trim).T), off, strict=True):
                path, held = fin_path(idle[scene.speed].with_fin(fin), scene.effects, scene.values), fin[:-1]
                beside[: held.size, 0], beside[: held.size, 1] = path.start - held, path.end - held
            if np.array_equal(off, before):  # converged
                break
    return found


def _idle(scenes: Sequence[OperatingPoint], time: FloatArray) -> dict[float, Record]:
    """Return a record with a zero command at times (n,) s for each speed of the operating points."""
    none = np.zeros(time.size)
    return {speed: command_record(scenes[0].axis, time, none, speed=speed) for speed in {s.speed for s in scenes}}
