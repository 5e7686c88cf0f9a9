"""Closed-loop steps in time of every draw of a plant, and what is read off them: overshoot, settling, steady error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.display import Brief
from fieldsid.numerics.arrays import FloatArray
from fieldsid.schedule.closed_loop_kernel import close_loop
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.record import Row

STEP_S = 0.02
SETTLING_BAND = 0.05
FASTEST_LAG_S = 1e-6


@dataclass(frozen=True, slots=True, repr=False)
class Steps(Brief):
    """Responses of n cases: time (t,) s, angle (t, n) rad, fin command or angle (t, n) rad, depth (t, n) m."""

    time: FloatArray
    angle: FloatArray
    fin: FloatArray
    depth: FloatArray


def overshoot(values: FloatArray, size: float) -> FloatArray:
    """Return the overshoot of steps (t, n) of `size`, (n,), as a share of it."""
    return np.asarray(np.maximum(np.max(values / size, axis=0) - 1.0, 0.0))


def settling(time: FloatArray, values: FloatArray, size: float) -> FloatArray:
    """Return the time after which steps (t, n) stay within 5 % of `size`, (n,) s; inf if never."""
    off = np.abs(values - size) > SETTLING_BAND * abs(size)
    last = time.size - 1 - np.argmax(off[::-1], axis=0)
    return np.asarray(np.where(off.any(axis=0), np.where(last >= time.size - 1, np.inf, time[last]), 0.0))


def steady_error(values: FloatArray, wanted: float) -> FloatArray:
    """Return wanted less the mean of the last twentieth of (t, n), (n,)."""
    tail = max(1, values.shape[0] // 20)
    return np.asarray(wanted - values[-tail:].mean(axis=0))


def step_response(plant: LinearPlant, row: Row, *, reference: float, seconds: float, offset: float = 0.0) -> Steps:
    """Return the response of every draw of a plant under a row's gains to a step of the reference (rad) at time 0.

    `offset` (rad) is added to the fin: a bent fin, on top of the plant's own trim.
    """
    return _run(plant, row, reference, 0.0, seconds, offset, 0.0)


def depth_response(plant: LinearPlant, row: Row, *, step: float, seconds: float, pitch_limit: float) -> Steps:
    """Return the response to a step of the wanted depth (m) through pitch, z' = -u theta, pitch asked within pitch_limit."""
    return _run(plant, row, 0.0, step, seconds, 0.0, pitch_limit)


def _run(
    plant: LinearPlant, row: Row, reference: float, depth: float, seconds: float, offset: float, pitch_limit: float
) -> Steps:
    plants = np.stack(
        [
            plant.damping, plant.stiffness, plant.authority, plant.offset + offset, plant.quadratic, plant.beyond_square,
            plant.crossflow, plant.cross_damping, plant.cross_rate, plant.cross_fin, plant.cross_quadratic,
            np.exp(-STEP_S / np.maximum(plant.lag, FASTEST_LAG_S)), np.round(plant.delay / STEP_S),
            np.minimum(plant.fin_rate, 1e6) * STEP_S,
        ],
        axis=1,
    )  # fmt: skip
    gains = row.gains
    loop = np.array(
        [gains.kp, gains.ki, gains.kd, row.feed_forward, row.reference_gain, row.fin_limit, row.depth_gain, pitch_limit]
    )
    count = round(seconds / STEP_S) + 1
    out = np.empty((plant.count, count, 3))
    close_loop(np.ascontiguousarray(plants), loop, reference, depth, plant.speed, STEP_S, out)
    angle, fin, deep = (np.ascontiguousarray(out[:, :, j].T) for j in range(3))
    return Steps(STEP_S * np.arange(count, dtype=np.float64), angle, fin, deep)
