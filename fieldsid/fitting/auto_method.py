"""The "auto" rule: prediction error under a disturbance, output error under white noise or a missing effect.

Prediction error attributes slow residuals to a disturbance and gives them little weight. Where a missing effect causes them, its
free run is the worse. Residuals of a missing effect follow the fin and the motion; those of a disturbance do not.
"""

from __future__ import annotations

import numpy as np

from fieldsid.errors import ModelError
from fieldsid.fitting.covariance.reml import MAX_NOISE_SAMPLES
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of
from fieldsid.fitting.predict.predict import refit_nuisances
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

MIN_FOLLOWING_SHARE = 0.6
"""Share of the slow residual that fin and motion explain, from which on an effect is missing."""
MAX_FREE_RUN_RATIO = 2.0
"""Free-run error of prediction error over that of output error that a disturbance can explain (at most 1.8 in 48 trials)."""
MEMORY_TIME_CONSTANTS_S = (0.3, 1.0, 3.0, 10.0, 30.0)
"""Time constants through which the fin may have left its mark, as far as the record is eight times as long."""
BLOCK_S = 0.25
DISTURBANCE_TIME_LIMITS_S = (0.12, 8.0)
"""Correlation times (s) that a disturbance can have; faster or slower residuals are a model error or a drift."""


def residuals_are_disturbed(problem: Problem, solution: Solution) -> bool:
    """Whether the residuals are coloured by a disturbance of plausible correlation time that follows neither fin nor motion."""
    noise = solution.noise
    of_the_sea = noise.disturbance > 0.0 and DISTURBANCE_TIME_LIMITS_S[0] < noise.disturbance_time < DISTURBANCE_TIME_LIMITS_S[1]
    return of_the_sea and residual_follows_fin(problem.first(MAX_NOISE_SAMPLES), solution.x) < MIN_FOLLOWING_SHARE


def keeps_free_run(problem: Problem, plain: Solution, refined: Solution, weights: Noise) -> bool:
    """Whether the refined solution's free run is no worse than a disturbance can make it, nuisances refitted."""
    x = refined.x
    try:
        for run in range(len(problem.records)):
            x = refit_nuisances(problem, x, run, weights)
    except ModelError:
        return False
    return cost_of(problem, x, weights) <= MAX_FREE_RUN_RATIO**2 * cost_of(problem, plain.x, weights)


def residual_follows_fin(problem: Problem, x: FloatArray) -> float:
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
    return lags, [_fading_mean(fin, tau) for tau in MEMORY_TIME_CONSTANTS_S if 8.0 * tau < length]


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


def _fading_mean(values: FloatArray, tau: float) -> FloatArray:
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
