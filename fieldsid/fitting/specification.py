"""Is what a prediction-error fit leaves a disturbance, or is the model's form wrong? Two tests under the fit's own noise.

A disturbance of the sea is independent of what the fin did before, and output error, which weighs the slow part of the
motion most, then estimates the same numbers as prediction error, which weighs the fast part most: only less well. Where
the form is wrong each finds the numbers that suit its own part.
"""

from __future__ import annotations

import numpy as np

from fieldsid.fitting.covariance.output_error_covariance import coloured_covariance
from fieldsid.fitting.covariance.reml import MAX_NOISE_SAMPLES
from fieldsid.fitting.fin_history import blocks_of, columns_of
from fieldsid.fitting.optimise.levenberg_marquardt import covariance, levenberg_marquardt
from fieldsid.fitting.optimise.residual_weights import white_weights
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.whiten import whiten
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.tail_probabilities import chi_square_tail, f_tail

MIN_VARIANCE_SHARE = 1e-3
"""Share of output error's variance, over that of the most uncertain direction, below which the two estimates are one."""


def agreement(problem: Problem, x: FloatArray, noise: Noise) -> float:
    """Return the p-value of output error and prediction error estimating the same numbers, at the minimum x of the latter.

    Output error's estimate is its step from x, to first order: at its own minimum, which a strong disturbance takes far
    away, the equations are others. The difference has the covariance of the one less that of the other, chi-square
    when the form and the noise are right. Source: Hausman 1978, Econometrica 46(6).
    """
    part, count = problem.first(MAX_NOISE_SAMPLES // len(problem.records)), problem.layout.shared
    inside = np.flatnonzero((problem.layout.low < x) & (x < problem.layout.high))
    kept = inside < count
    weights = white_weights(part, x)
    plain = levenberg_marquardt(part, x, weights, free=inside.tolist(), max_iterations=0)
    fine = levenberg_marquardt(part, x, noise, free=inside.tolist(), max_iterations=0)
    if not (kept.any() and np.isfinite(plain.cost) and np.isfinite(fine.cost)):
        return 0.0
    plain_covariance, efficient = coloured_covariance(part, plain, weights, noise), covariance(fine.normal)
    apart = (covariance(plain.normal) @ plain.gradient - efficient @ fine.gradient)[kept]
    scale = np.sqrt(np.maximum(np.diag(plain_covariance)[kept], np.finfo(float).tiny))
    values, vectors = np.linalg.eigh((plain_covariance - efficient)[np.ix_(kept, kept)] / np.outer(scale, scale))
    distinct = values > MIN_VARIANCE_SHARE * max(float(values[-1]), MIN_VARIANCE_SHARE)
    along = vectors.T @ (apart / scale)
    return chi_square_tail(float(np.sum(along[distinct] ** 2 / values[distinct])), int(distinct.sum())) if distinct.any() else 1.0


def independence(problem: Problem, x: FloatArray, noise: Noise) -> float:
    """Return the p-value of the innovations at x being unrelated.

    To fin and motion before, that is: an F test on block means, the smaller p of both channels doubled, of the fin and its
    history, the rate, and their squares with sign, all one block earlier, so that an autopilot's answer to a disturbance
    is no relation. Source: Ljung 1999, section 16.6.
    """
    sums = np.zeros((2, 4))
    for run, record in enumerate(problem.records):
        motion, base = problem.simulate(x, run)
        residual, _ = problem.residual(x, run)
        white, _ = whiten(record, noise, base.damping, base.stiffness, residual[None])
        columns = columns_of(record, motion.rate)[:-1]
        for channel in np.flatnonzero(record.ok.any(axis=1)):
            sums[channel] += _explained(white[0, channel], record, columns)
    return min(1.0, 2.0 * min(f_tail(e / k / (left / f), k, f) if k and f and left else 1.0 for e, left, k, f in sums.tolist()))


def _explained(white: FloatArray, record: Record, columns: FloatArray) -> tuple[float, float, float, float]:
    """Return what columns (m, p) explain of a run's innovations, what they leave, and the degrees of freedom of both."""
    e = blocks_of(white, record)[1:]
    if e.size <= 2 * columns.shape[1]:
        return 0.0, 0.0, 0.0, 0.0
    # the constant is among the columns, and is no relation
    solved, _, rank, _ = np.linalg.lstsq(columns, e, rcond=1e-9)
    centred, left = e - e.mean(), e - columns @ solved
    power = float(left @ left)
    return float(centred @ centred) - power, power, float(rank - 1), float(e.size - rank)
