"""Closed-loop flight of a model: the exact core stepped sample by sample, the autopilot where the command is NaN."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fieldsid.dynamics.assemble import KernelInputs, assemble, fin_path
from fieldsid.dynamics.free_run import command_record
from fieldsid.dynamics.nonlinear_kernel import over_interval
from fieldsid.maneuvers import steer
from fieldsid.models.hull import FIN, MOMENT_END, MOMENT_START, kinds_of, named
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit
from fieldsid.planning.flight.operating_point import OperatingPoint

ACTUATOR_ROUNDS = 4
"""Times the fin's own path is put back into the loop; each round removes what the one before left of its error."""


@dataclass(frozen=True, slots=True)
class Response:
    """One flight about straight and level: time (n,) s, fin command about trim rad, angle rad, rate rad/s (n,)."""

    time: FloatArray
    command: FloatArray
    angle: FloatArray
    rate: FloatArray


@inner
def hold_fin(drive: FloatArray, i: int, start: float, end: float, push_start: float, push_end: float) -> None:
    """Add a fin (rad at both ends) to row i of a drive without one, with what a rad of it pushes at both ends."""
    drive[i, MOMENT_START] += push_start * start
    drive[i, MOMENT_END] += push_end * end
    drive[i, FIN] = 0.5 * (start + end)


@jit
def closed_loop(
    steps: FloatArray, drive: FloatArray, c: FloatArray, pieces: int, asked: FloatArray, off: FloatArray,
    push: FloatArray, gains: FloatArray, limits: FloatArray, command: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Fill command (n,) and out (n, 3): angle, rate, cross state from rest.

    asked (n,): fin about trim, NaN where the autopilot steers. off (n-1, 2): fin angle minus command at both ends of each
    interval. push (n-1, 2): moment per rad at start and end. gains (3,): angle, rate, fin limit
    of the autopilot. limits (4,): low, high, rate, trim fin.
    """
    n, state, last = asked.shape[0], (0.0, 0.0, 0.0), 0.0
    k, kinds = named(c), kinds_of(c)
    for i in range(n):
        out[i, 0], out[i, 1], out[i, 2] = state
        fin = steer(asked[i], state[0], state[1], last, gains, limits[2] * steps[min(i, n - 2)], limits[0], limits[1])
        command[i] = fin
        last = fin
        if i == n - 1:
            break
        hold_fin(drive, i, limits[3] + fin + off[i, 0], limits[3] + fin + off[i, 1], push[i, 0], push[i, 1])
        state = over_interval(k, kinds, drive, i, steps[i], pieces, -0.5 * steps[i], state)


@dataclass(frozen=True, slots=True)
class Prepared:
    """What the loop needs of a scene and never changes: the core's arrays without fin, and the fin's push."""

    time: FloatArray
    steps: FloatArray
    drive: FloatArray
    constants: FloatArray
    pieces: int
    push: FloatArray


@lru_cache(maxsize=16)
def prepared(scene: OperatingPoint, count: int, rate_hz: float) -> Prepared:
    """Return the arrays of a scene over `count` samples."""
    time = np.arange(count) / rate_hz
    idle = scene.record(time, np.zeros(count))
    arrays = assemble(idle, scene.effects, replace(scene.base, authority=0.0), scene.values, scene.scale)
    return Prepared(time, idle.steps, arrays.drive, arrays.constants, arrays.pieces, fin_push(scene, arrays))


def fin_push(scene: OperatingPoint, arrays: KernelInputs) -> FloatArray:
    """Return the moments that a rad of fin adds to the drives at both ends of each interval, (n-1, 2)."""
    n = arrays.drive.shape[0] + 1
    factor = np.ones(n) if arrays.terms.authority_factor is None else arrays.terms.authority_factor
    return scene.base.authority * np.column_stack([factor[:-1], factor[1:]])


def idle_records(scenes: Sequence[OperatingPoint], time: FloatArray) -> dict[float, Record]:
    """Return a record without a command at some times (n,) s for each speed of some scenes."""
    none = np.zeros(time.size)
    return {speed: command_record(scenes[0].axis, time, none, speed=speed) for speed in {s.speed for s in scenes}}


def fin_offset(scene: OperatingPoint, idle: Mapping[float, Record], command: FloatArray) -> FloatArray:
    """Return the fin's angle less its command (n,) about trim at both ends of every interval, (n-1, 2)."""
    held = command[:-1] + scene.trim_fin
    real = fin_path(idle[scene.speed].with_fin(command + scene.trim_fin), scene.effects, scene.values)
    return np.column_stack([real.start - held, real.end - held])
