"""Score and Fisher information of the noise parameters, from forward differences through the Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.models.record import Record
from fieldsid.noise.kalman.univariate import kalman_filter
from fieldsid.noise.noise_kinds import IS_STANDARD_DEVIATION
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit

LOG_STEP = 3e-4
"""Step of the logarithm of a noise parameter in a forward difference."""
STEP_FACTOR, PER_STEP = float(np.exp(LOG_STEP)), 1.0 / LOG_STEP


@dataclass(frozen=True, slots=True)
class Innovations:
    """The standardised innovations of a residual under a noise, their standard deviations, (2 n,) each; the log likelihood."""

    standardised: FloatArray
    innovation_std: FloatArray
    likelihood: float


def innovations_of(record: Record, a: float, k: float, noise: FloatArray, residual: FloatArray) -> Innovations:
    """Return the innovations of a residual (2, n) under a noise vector (7,) that acts on a base of damping a and stiffness k."""
    standardised, innovation_std = np.empty((2, *residual.shape))
    series = np.ascontiguousarray(residual[None])
    logs = kalman_filter(record.nominal_steps, record.ok, a, k, noise, series, standardised[None], innovation_std)
    e = standardised.ravel()
    return Innovations(e, innovation_std.ravel(), -0.5 * (logs + float(e @ e)))


def information(
    record: Record, a: float, k: float, noise: FloatArray, place: npt.NDArray[np.int64], residual: FloatArray, here: Innovations
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return the score (P,) and the Fisher information (P, P) of a noise, given the innovations `here` of a residual (2, n).

    Both are with respect to the logarithms x of the noise parameters at `place` (P,). These are all that are neither zero nor
    fixed, a standard deviation first. They follow from forward differences of the innovations e and of the logarithms of their
    standard deviations s:
        dl/dx = -sum(ds + e de),  F = sum(2 ds ds' + (de + e ds) (de' + e ds'))
    Where all standard deviations grow by one factor, the gains of the filter do not change: summed over the standard deviations,
    the ds of a sample are 1 and the de are -e, which gives those of the first.
    Source: Harvey 1989, Forecasting, structural time series models and the Kalman filter, section 3.4.5.
    """
    standardised, innovation_std = _with_increased_parameters(record, a, k, noise, place, residual)
    d_innovations, d_log_std = standardised.reshape(place.size, -1), innovation_std.reshape(place.size, -1)
    score = score_of_innovations(
        record.ok.ravel(), here.standardised, 1.0 / here.innovation_std, IS_STANDARD_DEVIATION[place], d_innovations, d_log_std
    )
    return score, 2.0 * d_log_std @ d_log_std.T + d_innovations @ d_innovations.T


def _with_increased_parameters(
    record: Record, a: float, k: float, noise: FloatArray, place: npt.NDArray[np.int64], residual: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return innovations and their standard deviations (P, 2, n) with each noise parameter but the first increased."""
    series = np.ascontiguousarray(residual[None])
    standardised, innovation_std = np.empty((2, place.size, *residual.shape))
    for row, p in enumerate(place.tolist()[1:], 1):
        moved = noise.copy()
        moved[p] *= STEP_FACTOR
        kalman_filter(record.nominal_steps, record.ok, a, k, moved, series, standardised[row][None], innovation_std[row])
    return standardised, innovation_std


@jit
def score_of_innovations(
    seen: npt.NDArray[np.bool_], e: FloatArray, over: FloatArray, is_size: npt.NDArray[np.bool_],
    d_innovations: FloatArray, d_log_std: FloatArray,
) -> FloatArray:  # fmt: skip
    """Return the score (P,); replace the increased innovations and deviations (P, m) by de + e ds and ds. over is 1 / s."""
    score = np.zeros(d_innovations.shape[0])
    for l in range(e.size):
        d_log_std[0, l], d_innovations[0, l] = 1.0 * seen[l], -e[l]
    for row in range(1, d_innovations.shape[0]):
        total, share = 0.0, 1.0 * is_size[row]
        for l in range(e.size):
            ds, de = (d_log_std[row, l] * over[l] - 1.0) * PER_STEP, (d_innovations[row, l] - e[l]) * PER_STEP
            d_log_std[row, l], d_innovations[row, l] = ds, de + e[l] * ds
            d_log_std[0, l] -= share * ds
            d_innovations[0, l] -= share * de
            total += ds + e[l] * de
        score[row] = -total
    total = 0.0
    for l in range(e.size):
        total += d_log_std[0, l] + e[l] * d_innovations[0, l]
        d_innovations[0, l] += e[l] * d_log_std[0, l]
    score[0] = -total
    return score
