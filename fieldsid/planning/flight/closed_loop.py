"""Closed-loop flight of a model: the exact core stepped sample by sample, the autopilot where the command is NaN."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fieldsid.dynamics.assemble import KernelInputs, assemble
from fieldsid.dynamics.nonlinear_kernel import over_interval
from fieldsid.maneuvers import steer
from fieldsid.models.hull import FIN, MOMENT_END, MOMENT_START, kinds_of, named
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit
from fieldsid.planning.flight.operating_point import OperatingPoint


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


@lru_cache(maxsize=16)
def prepared(scene: OperatingPoint, count: int, rate_hz: float) -> tuple[KernelInputs, FloatArray]:
    """Return the core's arrays of a scene over `count` samples, without fin, and what a rad of fin adds to its drives, (n-1, 2).

    That is the moment at both ends of each interval.
    """
    idle = scene.record(np.arange(count) / rate_hz, np.zeros(count))
    arrays = assemble(idle, scene.effects, replace(scene.base, authority=0.0), scene.values, scene.scale)
    factor = np.ones(count) if arrays.terms.authority_factor is None else arrays.terms.authority_factor
    return arrays, scene.base.authority * np.column_stack([factor[:-1], factor[1:]])
