"""Score and Fisher information of a noise's numbers, from forward differences through the Kalman filter."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.kalman import filtered
from fieldsid.logs.run import FloatArray
from fieldsid.models.record import Record

LOG_STEP = 3e-4
"""Relative change of a noise's number whose effect is taken for a derivative."""


def information(
    record: Record, a: float, k: float, noise: FloatArray, place: npt.NDArray[np.int64], residual: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Return the log likelihood of a residual (2, n), its score (P,) and its Fisher information (P, P).

    Both are by the logarithms x of the noise's numbers at `place` (P,), from forward differences of the innovations e
    and the logarithms of their spreads s:
        dl/dx = -sum(ds + e de),  F = sum(2 ds ds' + (de + e ds) (de' + e ds'))
    Source: Harvey 1989, Forecasting, structural time series models and the Kalman filter, section 3.4.5.
    """
    series, shape = np.ascontiguousarray(residual[None]), (place.size + 1, *residual.shape)
    errors, spreads = np.empty(shape), np.empty(shape)
    logs = filtered(record.even, record.ok, a, k, noise, series, errors[:1], spreads[0])
    for row, p in enumerate(place, start=1):
        moved = noise.copy()
        moved[p] *= np.exp(LOG_STEP)
        filtered(record.even, record.ok, a, k, moved, series, errors[row : row + 1], spreads[row])
    e = errors[0].ravel()
    wide = ((spreads[1:] / spreads[0] - 1.0) / LOG_STEP).reshape(place.size, -1)
    steep = ((errors[1:] - errors[0]) / LOG_STEP).reshape(place.size, -1)
    raw = steep + wide * e
    return -0.5 * (logs + float(e @ e)), -(wide.sum(axis=1) + steep @ e), 2.0 * wide @ wide.T + raw @ raw.T
