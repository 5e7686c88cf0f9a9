"""Noise from the residuals of a fit, allowing for what the fit took out of them: restricted likelihood.

    l(noise) = -1/2 [log|S| + log|J' S^-1 J| + r' S^-1 r],   r = e - J (J' S^-1 J)^-1 J' S^-1 e
e are the residuals at some x, J their sensitivities to all that was estimated: r is what generalised least squares
under that noise would leave, so that x need not be its own minimum, and slow noise that parameters absorb is counted.
Source: Patterson and Thompson 1971, Biometrika 58(3), Recovery of inter-block information.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.descent import covariance
from fieldsid.fitting.kalman import innovations
from fieldsid.fitting.noise import FAMILIES, estimate_noise
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.whiteness import WHITE_ENOUGH, white_p
from fieldsid.fitting.whitening import noise_vector
from fieldsid.logs.run import FloatArray
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

GAIN_NEEDED = 4.0
"""Log likelihood a family must gain over a simpler one for each parameter more (about twice Akaike's 1)."""
NO_INFORMATION = 1e-12
ENOUGH = 30_000
"""Samples over all runs that noise is estimated from; of longer records the first part is taken."""


@dataclass(frozen=True, slots=True)
class Line:
    """One run at x: base dynamics, residual and sensitivities stacked (1 + P, 2, n), and where those belong (P,)."""

    record: Record
    damping: float
    stiffness: float
    stack: FloatArray
    place: FloatArray

    @property
    def residual(self) -> FloatArray:
        """Measured minus simulated, (2, n)."""
        return np.asarray(self.stack[0])


def lines_of(problem: Problem, x: FloatArray) -> list[Line]:
    """Return the linearisation of every run."""
    lines = []
    for run, record in enumerate(problem.records):
        r = problem.linearise(x, run)
        lines.append(Line(record, max(r.base.damping, 1e-3), max(r.base.stiffness, 0.0), r.stack, np.array(r.slots, dtype=int)))
    return lines


def products(lines: list[Line], count: int, noise: FloatArray) -> tuple[FloatArray, float]:
    """Return the whitened products of residual and sensitivities (1 + F, 1 + F), and the log determinant of the noise.

    noise is a vector (7,), count the number F of slots.
    """
    square, logs = np.zeros((count + 1, count + 1)), 0.0
    for line in lines:
        white = np.empty_like(line.stack)
        r = line.record
        logs += innovations(r.even, r.ok, line.damping, line.stiffness, noise, line.stack, white)
        flat = white.reshape(white.shape[0], -1)
        where = np.concatenate([[0], 1 + line.place]).astype(int)
        square[np.ix_(where, where)] += flat @ flat.T
    return square, logs


def restricted_likelihood(lines: list[Line], count: int, noise: FloatArray) -> float:
    """Return the restricted log likelihood, up to its constant, of a noise vector (7,); count is the number of slots."""
    square, logs = products(lines, count, noise)
    return -0.5 * (logs + _profiled(square))


def generalised(lines: list[Line], count: int, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the step (F,) to the generalised least squares under a noise vector (7,), and its covariance (F, F)."""
    square, _ = products(lines, count, noise)
    inverse = covariance(square[1:, 1:])
    return inverse @ square[1:, 0], inverse


def _profiled(square: FloatArray) -> float:
    """Return r' S^-1 r + log|J' S^-1 J| from the products of residual and sensitivities, (1 + F, 1 + F)."""
    scale = np.sqrt(np.diag(square)[1:])
    known = np.flatnonzero(scale > 0.0)
    scale = scale[known]
    normal = square[1:, 1:][np.ix_(known, known)] / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(normal)
    kept = values > NO_INFORMATION
    share = vectors.T[kept] @ (square[1:, 0][known] / scale)
    left = square[0, 0] - np.sum(share**2 / values[kept])
    return float(left + np.sum(np.log(values[kept])) + 2.0 * np.sum(np.log(scale)))


def restricted_noise(problem: Problem, lines: list[Line], family: str, start: Noise) -> tuple[Noise, float]:
    """Return the noise of a family of highest restricted likelihood, and that log likelihood."""
    count = len(problem.layout.slots)
    dynamics, residuals = [(line.damping, line.stiffness) for line in lines], [line.residual for line in lines]
    return estimate_noise(
        [line.record for line in lines],
        dynamics,
        residuals,
        family,
        start,
        lambda noise: restricted_likelihood(lines, count, noise),
    )


def best_noise(problem: Problem, x: FloatArray, start: Noise) -> tuple[str, Noise, float]:
    """Return the family, noise and log likelihood that the residuals at x support, by a penalised likelihood.

    Both colours together are tried only where the innovations under the better one alone are not white.
    """
    problem = problem.first(ENOUGH // len(problem.records))
    lines = lines_of(problem, x)
    found: dict[str, tuple[Noise, float]] = {}

    def worth(family: str) -> float:
        return found[family][1] - GAIN_NEEDED * len(FAMILIES[family])

    for family in FAMILIES:
        if family == "both" and whitened(lines, max(found, key=worth), found):
            continue
        found[family] = restricted_noise(problem, lines, family, start)
    best = max(found, key=worth)
    return best, *found[best]


def whitened(lines: list[Line], family: str, found: Mapping[str, tuple[Noise, float]]) -> bool:
    """Whether the innovations of the residuals under a family's noise pass as white."""
    noise = noise_vector(found[family][0])
    whites = [np.empty((1, *line.residual.shape)) for line in lines]
    for line, white in zip(lines, whites, strict=True):
        innovations(line.record.even, line.record.ok, line.damping, line.stiffness, noise, line.stack[:1], white)
    return all(
        white_p(w[0, channel][line.record.ok[channel]] for line, w in zip(lines, whites, strict=True)) >= WHITE_ENOUGH
        for channel in range(2)
    )
