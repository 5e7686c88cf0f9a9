"""Two tests of whether the residuals of a prediction-error fit are a disturbance or the form of the model is wrong.

A disturbance by the sea is independent of the earlier fin. Output error weighs the slow part of the motion most, prediction error
the fast part. Under a disturbance alone both estimate the same parameters, output error with the larger variance. Where the form
of the model is wrong, each finds the parameters that suit the part of the motion it weighs most.
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
"""Eigenvalue of the covariance of the difference, over the largest, below which its direction is left out of the test."""


def agreement(problem: Problem, x: FloatArray, noise: Noise) -> float:
    """Return the p-value of Hausman's test that output error and prediction error estimate the same parameters.

    x is the minimum of prediction error. The estimate of output error is taken as its Gauss-Newton step from x: a strong
    disturbance may put its minimum so far away that the linearisation differs. The covariance of the difference is that of output
    error less that of prediction error, and the test statistic is chi-square where the form of the model and the noise model are
    right. Source: Hausman 1978, Econometrica 46(6).
    """
    part, count = problem.first(MAX_NOISE_SAMPLES // len(problem.records)), problem.layout.shared
    inside = np.flatnonzero((problem.layout.low < x) & (x < problem.layout.high))
    is_shared = inside < count
    weights = white_weights(part, x)
    oe = levenberg_marquardt(part, x, weights, free=inside.tolist(), max_iterations=0)
    pem = levenberg_marquardt(part, x, noise, free=inside.tolist(), max_iterations=0)
    if not (is_shared.any() and np.isfinite(oe.cost) and np.isfinite(pem.cost)):
        return 0.0
    oe_covariance, pem_covariance = (
        coloured_covariance(part, oe, weights, noise),
        covariance(pem.normal),
    )
    difference = (covariance(oe.normal) @ oe.gradient - pem_covariance @ pem.gradient)[is_shared]
    scale = np.sqrt(np.maximum(np.diag(oe_covariance)[is_shared], np.finfo(float).tiny))
    values, vectors = np.linalg.eigh((oe_covariance - pem_covariance)[np.ix_(is_shared, is_shared)] / np.outer(scale, scale))
    distinct = values > MIN_VARIANCE_SHARE * max(float(values[-1]), MIN_VARIANCE_SHARE)
    projected = vectors.T @ (difference / scale)
    return (
        chi_square_tail(float(np.sum(projected[distinct] ** 2 / values[distinct])), int(distinct.sum()))
        if distinct.any()
        else 1.0
    )


def independence(problem: Problem, x: FloatArray, noise: Noise) -> float:
    """Return the p-value of the hypothesis that the innovations at x do not depend on earlier fin and motion.

    It is an F test of a regression, in block means, on the fin, its history, the rate and their signed squares, all one block
    earlier: an autopilot's reaction to a disturbance is then no dependence. The smaller p of both channels is doubled.
    Source: Ljung 1999, section 16.6.
    """
    sums = np.zeros((2, 4))
    for run, record in enumerate(problem.records):
        motion, base = problem.simulate(x, run)
        residual, _ = problem.residual(x, run)
        white, _ = whiten(record, noise, base.damping, base.stiffness, residual[None])
        columns = columns_of(record, motion.rate)[:-1]
        for channel in np.flatnonzero(record.ok.any(axis=1)):
            sums[channel] += _explained_squares(white[0, channel], record, columns)
    return min(
        1.0,
        2.0 * min(f_tail(e / k / (rest / f), k, f) if k and f and rest else 1.0 for e, rest, k, f in sums.tolist()),
    )


def _explained_squares(white: FloatArray, record: Record, columns: FloatArray) -> tuple[float, float, float, float]:
    """Return the sums of squares of a run's innovations that columns (m, p) explain and do not, and both degrees of freedom."""
    e = blocks_of(white, record)[1:]
    if e.size <= 2 * columns.shape[1]:
        return 0.0, 0.0, 0.0, 0.0
    # the constant is among the columns, but does not count as a dependence
    solved, _, rank, _ = np.linalg.lstsq(columns, e, rcond=1e-9)
    centred, residual = e - e.mean(), e - columns @ solved
    power = float(residual @ residual)
    return float(centred @ centred) - power, power, float(rank - 1), float(e.size - rank)
