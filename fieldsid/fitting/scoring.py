"""Score and Fisher information of a noise's numbers, from forward differences through the Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.effort import count
from fieldsid.fitting.kalman import filtered
from fieldsid.fitting.kalman_abreast import LANES, abreast
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
    """A residual under a noise: standardised innovations and their spreads, (2 n,) each, and the log likelihood.

    moved is the same of errors and spreads, (P, 2, n) each, with each of the noise's numbers moved, where that came with it.
    """

    errors: FloatArray
    spreads: FloatArray
    likelihood: float
    moved: tuple[FloatArray, FloatArray] | None = None


def innovated(
    record: Record, a: float, k: float, noise: FloatArray, place: npt.NDArray[np.int64], residual: FloatArray
) -> Innovated:
    """Return what a residual (2, n) comes to under a noise vector (7,) that moves a base of damping a and stiffness k.

    Where sea and sensors both are noisy that of the noises with one of the numbers at `place` (P,) moved comes with it.
    """
    if place.size < noise.size:
        errors, spreads = np.empty((1, *residual.shape)), np.empty(residual.shape)
        logs = filtered(record.even, record.ok, a, k, noise, np.ascontiguousarray(residual[None]), errors, spreads)
        return _innovated(errors[0], spreads, logs)
    errors, spreads = np.empty((LANES, *residual.shape)), np.empty((LANES, *residual.shape))
    noises = np.tile(noise, (LANES, 1))
    noises[np.arange(1, place.size), place[1:]] *= MOVED
    abreast(record.even, record.ok, a, k, noises, residual, errors, spreads)
    # copies: the first rows become those of the first number moved
    wide = spreads[0].copy()
    return _innovated(errors[0].copy(), wide, 2.0 * float(np.log(wide).sum()), (errors[: place.size], spreads[: place.size]))


def _innovated(
    errors: FloatArray, spreads: FloatArray, logs: float, moved: tuple[FloatArray, FloatArray] | None = None
) -> Innovated:
    e = errors.ravel()
    return Innovated(e, spreads.ravel(), -0.5 * (logs + float(e @ e)), moved)


def information(
    record: Record, a: float, k: float, noise: FloatArray, place: npt.NDArray[np.int64], residual: FloatArray, here: Innovated
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return the score (P,) and the Fisher information (P, P) of a noise about what a residual (2, n) comes to `here`.

    Both are by the logarithms x of the noise's numbers at `place` (P,), all those that are not zero or held among them, a
    standard deviation first, from forward differences of the innovations e and the logarithms of their spreads s:
        dl/dx = -sum(ds + e de),  F = sum(2 ds ds' + (de + e ds) (de' + e ds'))
    Standard deviations that grow together leave the filter's gains as they are: over all of them the ds of a sample add up
    to one and the de to -e, which gives those of the first. What has moved in `here` is used up.
    Source: Harvey 1989, Forecasting, structural time series models and the Kalman filter, section 3.4.5.
    """
    count()
    errors, spreads = here.moved or _moved(record, a, k, noise, place, residual)
    steep, wide = errors.reshape(place.size, -1), spreads.reshape(place.size, -1)
    score = slopes_of(record.ok.ravel(), here.errors, 1.0 / here.spreads, IS_SIZE[place], steep, wide)
    return score, 2.0 * wide @ wide.T + steep @ steep.T


def _moved(
    record: Record, a: float, k: float, noise: FloatArray, place: npt.NDArray[np.int64], residual: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return innovations and their spreads (P, 2, n) with each of the noise's numbers moved but the first."""
    series = np.ascontiguousarray(residual[None])
    errors, spreads = np.empty((place.size, 1, *residual.shape)), np.empty((place.size, *residual.shape))
    for row, p in enumerate(place[1:], 1):
        moved = noise.copy()
        moved[p] *= MOVED
        filtered(record.even, record.ok, a, k, moved, series, errors[row], spreads[row])
    return errors[:, 0], spreads


@jit
def slopes_of(
    seen: npt.NDArray[np.bool_], e: FloatArray, over: FloatArray, is_size: npt.NDArray[np.bool_],
    steep: FloatArray, wide: FloatArray,
) -> FloatArray:  # fmt: skip
    """Return the score (P,); turn errors and spreads with each number moved, (P, m), into de + e ds and ds. over is 1 / s."""
    score = np.zeros(steep.shape[0])
    for l in range(e.size):
        wide[0, l], steep[0, l] = 1.0 * seen[l], -e[l]
    for row in range(1, steep.shape[0]):
        total, share = 0.0, 1.0 * is_size[row]
        for l in range(e.size):
            ds, de = (wide[row, l] * over[l] - 1.0) * PER_STEP, (steep[row, l] - e[l]) * PER_STEP
            wide[row, l], steep[row, l] = ds, de + e[l] * ds
            wide[0, l] -= share * ds
            steep[0, l] -= share * de
            total += ds + e[l] * de
        score[row] = -total
    total = 0.0
    for l in range(e.size):
        total += wide[0, l] + e[l] * steep[0, l]
        steep[0, l] += e[l] * wide[0, l]
    score[0] = -total
    return score
