"""The "auto" rule: prediction error under a disturbance, output error under white noise or a missing effect.

Prediction error takes slow residuals for a disturbance and trusts them little. Where a missing effect causes them it
gives the worse free run. A missing effect follows the fin and the motion; a disturbance of the sea does not.
"""

from __future__ import annotations

import numpy as np

from fieldsid.errors import ModelError
from fieldsid.fitting.descent import cost_of
from fieldsid.fitting.method import Solution
from fieldsid.fitting.predict import refit_own
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.restricted import ENOUGH
from fieldsid.logs.run import FloatArray
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

FOLLOWS = 0.6
"""Share of the slow residual that fin and motion explain, from which on an effect is missing."""
WORST_FREE_RUN = 2.0
"""Free-run error of prediction error over that of output error that a disturbance can explain (at most 1.8 in 48 trials)."""
MEMORY_S = (0.3, 1.0, 3.0, 10.0, 30.0)
"""Time constants through which the fin may have left its mark, as far as the record is eight times as long."""
BLOCK_S = 0.25
SEA_S = (0.12, 8.0)
"""Correlation times (s) a disturbance of the sea can have; what is faster or slower is a model error or a drift."""


def is_disturbed(problem: Problem, solution: Solution) -> bool:
    """Whether the residuals are coloured by a disturbance of the sea's own time, that follows neither fin nor motion."""
    noise = solution.noise
    of_the_sea = noise.disturbance > 0.0 and SEA_S[0] < noise.disturbance_time < SEA_S[1]
    return of_the_sea and follows_fin(problem.first(ENOUGH), solution.x) < FOLLOWS


def keeps_free_run(problem: Problem, plain: Solution, refined: Solution, weights: Noise) -> bool:
    """Whether the refined solution's free run is no worse than a disturbance can make it, own slots refitted."""
    x = refined.x
    try:
        for run in range(len(problem.records)):
            x = refit_own(problem, x, run, weights)
    except ModelError:
        return False
    return cost_of(problem, x, weights) <= WORST_FREE_RUN**2 * cost_of(problem, plain.x, weights)


def follows_fin(problem: Problem, x: FloatArray) -> float:
    """Return the share (0..1) of the low-frequency residual that the fin's history and the motion explain, over all runs."""
    explained, total = 0.0, 0.0
    for run, record in enumerate(problem.records):
        motion, _ = problem.simulate(x, run)
        residual, _ = problem.residual(x, run)
        channel = 1 if record.rate_ok.any() else 0
        e = block_means(residual[channel], record, BLOCK_S)
        columns = _columns(record, motion.rate)
        if e.size <= 2 * columns.shape[1]:
            return 1.0
        centred = e - e.mean()
        left = e - columns @ np.linalg.lstsq(columns, e, rcond=1e-9)[0]
        freedom = (e.size - 1) / (e.size - columns.shape[1])
        total += float(centred @ centred)
        explained += float(centred @ centred) - float(left @ left) * freedom
    return max(explained / total, 0.0) if total > 0 else 1.0


def _columns(record: Record, rate: FloatArray) -> FloatArray:
    """Return what a missing effect could follow, block means (m, p) scaled to one: fin, its history, rate, a constant."""
    lags, slow = fin_history(record)
    speed = block_means(rate, record, BLOCK_S)
    parts = [*lags, *slow, *(v * np.abs(v) for v in (lags[0], *slow, speed)), speed, np.ones(speed.size)]
    return np.column_stack([v / max(float(np.max(np.abs(v))), 1e-12) for v in parts])


def fin_history(record: Record) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return block means (m,) of the fin about its mean, now and up to three blocks before, and through ever slower lags."""
    fin = block_means(record.fin - record.fin.mean(), record, BLOCK_S)
    length = float(record.time[-1] - record.time[0])
    lags = [np.concatenate([np.zeros(k), fin[: fin.size - k]]) for k in range(4)]
    return lags, [_faded(fin, tau) for tau in MEMORY_S if 8.0 * tau < length]


def share_of_fin(record: Record) -> float:
    """Return the share (0..1) of the turning's power that follows the fin's history, as large as the data allow.

    The turning is the rate, or the slope of the angle where no rate was measured; slower than a block, about its mean.
    """
    by_rate = bool(record.rate_ok.any())
    values, ok = (record.rate, record.rate_ok) if by_rate else (record.angle, record.angle_ok)
    motion = block_means(np.interp(record.time, record.time[ok], values[ok]), record, BLOCK_S)
    motion = motion if by_rate else np.diff(motion, prepend=motion[0])
    lags, slow = fin_history(record)
    columns = np.column_stack([*lags, *slow, np.ones(motion.size)])
    centred = motion - motion.mean()
    power = float(centred @ centred)
    if motion.size <= columns.shape[1] or not power > 0.0:
        return 1.0
    left = motion - columns @ np.linalg.lstsq(columns, motion, rcond=1e-9)[0]
    return 1.0 - float(left @ left) / power


def _faded(values: FloatArray, tau: float) -> FloatArray:
    """Return block means (m,) through a first-order lag of time constant tau."""
    keep, out, last = float(np.exp(-BLOCK_S / tau)), np.empty_like(values), 0.0
    for i, value in enumerate(values.tolist()):
        out[i] = last = keep * last + (1.0 - keep) * value
    return out


def block_means(values: FloatArray, record: Record, seconds: float) -> FloatArray:
    """Return means (m,) over blocks of so many seconds: white sensor noise falls, colour stays."""
    width = max(1, round(seconds / float(np.median(record.steps))))
    count = values.size // width
    return np.asarray(values[: count * width].reshape(count, width).mean(axis=1))
