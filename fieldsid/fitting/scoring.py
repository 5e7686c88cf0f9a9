"""Score and Fisher information of a noise's numbers, from forward differences through the Kalman filter."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.kalman import filtered
from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit
from fieldsid.models.record import Record

LOG_STEP = 3e-4
"""Relative change of a noise's number whose effect is taken for a derivative."""


@jit
def slopes(
    steps: FloatArray,
    ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    place: npt.NDArray[np.int64],
    residual: FloatArray,
    known: FloatArray,
    wider: FloatArray,
    steeper: FloatArray,
) -> float:
    """Fill the innovations `known` (1, 2, n) of a residual (1, 2, n); return the sum of the log variances.

    wider and steeper (P, 2, n) are the forward differences of the logarithms of their spreads, and of themselves, by the
    logarithms of the noise's numbers at `place` (P,).
    """
    n = steps.shape[0] + 1
    spreads, moved_e, moved_spreads, moved = np.empty((2, n)), np.empty((1, 2, n)), np.empty((2, n)), noise.copy()
    log_sum = filtered(steps, ok, a, k, noise, residual, known, spreads)
    for c in range(place.shape[0]):
        moved[place[c]] = noise[place[c]] * np.exp(LOG_STEP)
        filtered(steps, ok, a, k, moved, residual, moved_e, moved_spreads)
        moved[place[c]] = noise[place[c]]
        for ch in range(2):
            for i in range(n):
                wider[c, ch, i] = (moved_spreads[ch, i] / spreads[ch, i] - 1.0) / LOG_STEP
                steeper[c, ch, i] = (moved_e[0, ch, i] - known[0, ch, i]) / LOG_STEP
    return log_sum


def information(
    record: Record, a: float, k: float, noise: FloatArray, place: npt.NDArray[np.int64], residual: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Return the log likelihood of a residual (2, n), its score (P,) and its Fisher information (P, P).

    Both are by the logarithms x of the noise's numbers at `place` (P,), from forward differences of the innovations e
    and the logarithms of their spreads s:
        dl/dx = -sum(ds + e de),  F = sum(2 ds ds' + (de + e ds) (de' + e ds'))
    Source: Harvey 1989, Forecasting, structural time series models and the Kalman filter, section 3.4.5.
    """
    count, series = place.size, np.ascontiguousarray(residual[None])
    known, wider, steeper = np.empty_like(series), np.empty((count, *residual.shape)), np.empty((count, *residual.shape))
    logs = slopes(record.even, record.ok, a, k, noise, place, series, known, wider, steeper)
    e, wide, steep = known.ravel(), wider.reshape(count, -1), steeper.reshape(count, -1)
    raw = steep + wide * e
    return -0.5 * (logs + float(e @ e)), -(wide.sum(axis=1) + steep @ e), 2.0 * wide @ wide.T + raw @ raw.T
