"""The noise model by restricted maximum likelihood (REML), which allows for the parameters estimated from the same residuals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.optimise.levenberg_marquardt import covariance
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.innovations import innovations
from fieldsid.noise.maximum_likelihood import estimate_noise
from fieldsid.noise.noise_kinds import JOINT_NOISE, NOISE_KINDS
from fieldsid.noise.whiten import base_dynamics, noise_vector
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.ljung_box import MIN_WHITENESS_P, ljung_box_p

PENALTY_PER_PARAMETER = 4.0
"""Log likelihood that a noise kind must gain over a simpler one for each further parameter (Akaike's criterion asks for 1)."""
MIN_INFORMATION_SHARE = 1e-12
MAX_NOISE_SAMPLES = 30_000
"""Samples over all runs that noise is estimated from; of longer records the first part is taken."""


@dataclass(frozen=True, slots=True)
class LinearisedRun:
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


def linearise_runs(problem: Problem, x: FloatArray) -> list[LinearisedRun]:
    """Return the linearisation of every run."""
    lines = []
    for run, record in enumerate(problem.records):
        r = problem.linearise(x, run)
        lines.append(
            LinearisedRun(record, *base_dynamics(r.base.damping, r.base.stiffness), r.stack, np.array(r.columns, dtype=int))
        )
    return lines


def whitened_products(lines: list[LinearisedRun], count: int, noise: FloatArray) -> tuple[FloatArray, float]:
    """Return the products (1 + F, 1 + F) of whitened residual and sensitivities, and the log determinant of the noise covariance.

    `noise` is a vector (7,); `count` is the number F of parameters.
    """
    square, logs = np.zeros((count + 1, count + 1)), 0.0
    for line in lines:
        white = np.empty_like(line.stack)
        r = line.record
        logs += innovations(r.nominal_steps, r.ok, line.damping, line.stiffness, noise, line.stack, white)
        flat = white.reshape(white.shape[0], -1)
        where = np.concatenate([[0], 1 + line.place]).astype(int)
        square[np.ix_(where, where)] += flat @ flat.T
    return square, logs


def reml_likelihood(lines: list[LinearisedRun], count: int, noise: FloatArray) -> float:
    """Return the restricted log likelihood, up to its constant, of a noise vector (7,); count is the number of parameters."""
    square, logs = whitened_products(lines, count, noise)
    return -0.5 * (logs + _profiled(square))


def gls_step(lines: list[LinearisedRun], count: int, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the step (F,) to the generalised least squares under a noise vector (7,), and its covariance (F, F)."""
    square, _ = whitened_products(lines, count, noise)
    inverse = covariance(square[1:, 1:])
    return inverse @ square[1:, 0], inverse


def _profiled(square: FloatArray) -> float:
    """Return r' S^-1 r + log|J' S^-1 J| from the products of residual and sensitivities, (1 + F, 1 + F)."""
    scale = np.sqrt(np.diag(square)[1:])
    known = np.flatnonzero(scale > 0.0)
    scale = scale[known]
    normal = square[1:, 1:][np.ix_(known, known)] / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(normal)
    kept = values > MIN_INFORMATION_SHARE
    share = vectors.T[kept] @ (square[1:, 0][known] / scale)
    left = square[0, 0] - np.sum(share**2 / values[kept])
    return float(left + np.sum(np.log(values[kept])) + 2.0 * np.sum(np.log(scale)))


def reml_noise(problem: Problem, lines: list[LinearisedRun], noise_kind: str, start: Noise) -> tuple[Noise, float]:
    """Return the noise of a family of highest restricted likelihood, and that log likelihood."""
    count = len(problem.layout.parameters)
    dynamics, residuals = [(line.damping, line.stiffness) for line in lines], [line.residual for line in lines]
    return estimate_noise(
        [line.record for line in lines],
        dynamics,
        residuals,
        noise_kind,
        start,
        lambda noise: reml_likelihood(lines, count, noise),
        evaluations=problem.evaluations,
    )


def select_noise(problem: Problem, x: FloatArray, start: Noise) -> tuple[str, Noise, float]:
    """Return the noise kind, noise and log likelihood that the residuals at x support, by penalised likelihood.

    Disturbance and sensor colour together are tried only where the innovations under the better one of them are not white.
    """
    problem = problem.first(MAX_NOISE_SAMPLES // len(problem.records))
    lines = linearise_runs(problem, x)
    found: dict[str, tuple[Noise, float]] = {}

    def penalised_likelihood(noise_kind: str) -> float:
        return found[noise_kind][1] - PENALTY_PER_PARAMETER * len(NOISE_KINDS[noise_kind].fields)

    for noise_kind in NOISE_KINDS:
        if noise_kind == JOINT_NOISE and innovations_are_white(lines, max(found, key=penalised_likelihood), found):
            continue
        found[noise_kind] = reml_noise(problem, lines, noise_kind, start)
    best = max(found, key=penalised_likelihood)
    return best, *found[best]


def innovations_are_white(lines: list[LinearisedRun], noise_kind: str, found: Mapping[str, tuple[Noise, float]]) -> bool:
    """Whether the innovations of the residuals under a noise kind pass the Ljung-Box test."""
    noise = noise_vector(found[noise_kind][0])
    whites = [np.empty((1, *line.residual.shape)) for line in lines]
    for line, white in zip(lines, whites, strict=True):
        innovations(line.record.nominal_steps, line.record.ok, line.damping, line.stiffness, noise, line.stack[:1], white)
    return all(
        ljung_box_p(w[0, channel][line.record.ok[channel]] for line, w in zip(lines, whites, strict=True)) >= MIN_WHITENESS_P
        for channel in range(2)
    )
