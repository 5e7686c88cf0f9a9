"""Score and Fisher information of a noise's numbers, from forward differences through the Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.kalman import filtered
from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit
from fieldsid.models.record import Record

LOG_STEP = 3e-4
"""Relative change of a noise's number whose effect is taken for a derivative."""
MOVED, PER_STEP = float(np.exp(LOG_STEP)), 1.0 / LOG_STEP
IS_SIZE = np.array([True, True, True, False, True, True, False])
"""Places in a noise's vector of its standard deviations, the others being correlation times."""


@dataclass(frozen=True, slots=True)
class Innovated:
    """A residual under a noise: standardised innovations and their spreads, (2 n,) each, and the log likelihood."""

    errors: FloatArray
    spreads: FloatArray
    likelihood: float


def innovated(record: Record, a: float, k: float, noise: FloatArray, residual: FloatArray) -> Innovated:
    """Return what a residual (2, n) comes to under a noise vector (7,) that moves a base of damping a and stiffness k."""
    errors, spreads = np.empty((1, *residual.shape)), np.empty(residual.shape)
    logs = filtered(record.even, record.ok, a, k, noise, np.ascontiguousarray(residual[None]), errors, spreads)
    e = errors.ravel()
    return Innovated(e, spreads.ravel(), -0.5 * (logs + float(e @ e)))


def information(
    record: Record, a: float, k: float, noise: FloatArray, place: npt.NDArray[np.int64], residual: FloatArray, here: Innovated
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return the score (P,) and the Fisher information (P, P) of a noise about what a residual (2, n) comes to `here`.

    Both are by the logarithms x of the noise's numbers at `place` (P,), all those that are not zero or held among them,
    from forward differences of the innovations e and the logarithms of their spreads s:
        dl/dx = -sum(ds + e de),  F = sum(2 ds ds' + (de + e ds) (de' + e ds'))
    Standard deviations that grow together leave the filter's gains as they are: over all of them the ds of a sample add up
    to one and the de to -e, which gives those of the first.
    Source: Harvey 1989, Forecasting, structural time series models and the Kalman filter, section 3.4.5.
    """
    is_size, series = IS_SIZE[place], np.ascontiguousarray(residual[None])
    first = int(np.argmax(is_size))
    errors, spreads = np.empty((place.size, 1, *residual.shape)), np.empty((place.size, *residual.shape))
    for row, p in enumerate(place):
        if row != first:
            moved = noise.copy()
            moved[p] *= MOVED
            filtered(record.even, record.ok, a, k, moved, series, errors[row], spreads[row])
    steep, wide = errors.reshape(place.size, -1), spreads.reshape(place.size, -1)
    score = _slopes(record.ok.ravel(), here.errors, 1.0 / here.spreads, is_size, first, steep, wide)
    return score, 2.0 * wide @ wide.T + steep @ steep.T


@jit
def _slopes(
    seen: npt.NDArray[np.bool_], e: FloatArray, over: FloatArray, is_size: npt.NDArray[np.bool_], first: int,
    steep: FloatArray, wide: FloatArray,
) -> FloatArray:  # fmt: skip
    """Return the score (P,); turn errors and spreads with each number moved, (P, m), into de + e ds and ds. over is 1 / s."""
    score = np.zeros(steep.shape[0])
    for l in range(e.size):
        wide[first, l], steep[first, l] = 1.0 * seen[l], -e[l]
    for row in range(steep.shape[0]):
        if row == first:
            continue
        total, share = 0.0, 1.0 * is_size[row]
        for l in range(e.size):
            ds, de = (wide[row, l] * over[l] - 1.0) * PER_STEP, (steep[row, l] - e[l]) * PER_STEP
            wide[row, l], steep[row, l] = ds, de + e[l] * ds
            wide[first, l] -= share * ds
            steep[first, l] -= share * de
            total += ds + e[l] * de
        score[row] = -total
    total = 0.0
    for l in range(e.size):
        total += wide[first, l] + e[l] * steep[first, l]
        steep[first, l] += e[l] * wide[first, l]
    score[first] = -total
    return score
