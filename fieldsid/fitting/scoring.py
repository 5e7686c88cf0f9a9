"""Score and Fisher information of a noise's numbers, from forward differences through the Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.kalman import filtered
from fieldsid.logs.run import FloatArray
from fieldsid.models.record import Record

LOG_STEP = 3e-4
"""Relative change of a noise's number whose effect is taken for a derivative."""
SIZES = (0, 1, 2, 4, 5)
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
    e, seen = here.errors, record.ok.ravel().astype(np.float64)
    wide, steep = np.zeros((place.size, e.size)), np.zeros((place.size, e.size))
    sizes = [row for row, p in enumerate(place) if p in SIZES]
    for row, p in enumerate(place):
        if row == sizes[0]:
            continue
        moved = noise.copy()
        moved[p] *= np.exp(LOG_STEP)
        there = innovated(record, a, k, moved, residual)
        wide[row] = (there.spreads / here.spreads - 1.0) / LOG_STEP
        steep[row] = (there.errors - e) / LOG_STEP
    wide[sizes[0]] = seen - wide[sizes[1:]].sum(axis=0)
    steep[sizes[0]] = -e - steep[sizes[1:]].sum(axis=0)
    raw = steep + wide * e
    return -(wide.sum(axis=1) + steep @ e), 2.0 * wide @ wide.T + raw @ raw.T
