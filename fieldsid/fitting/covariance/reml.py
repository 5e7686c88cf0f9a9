"""The noise model by restricted maximum likelihood (REML), which allows for the parameters estimated from the same residuals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

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
MIN_INFORMATION_SHARE = 1e-9
"""Least norm of a sensitivity after projection on the others, as a share of its norm: below, it is linearly dependent."""
MAX_NOISE_SAMPLES = 30_000
"""Most samples of all runs from which noise is estimated; of longer records the first part is used."""


@dataclass(frozen=True, slots=True)
class LinearisedRun:
    """One run at x: base dynamics, residual and sensitivities stacked (1 + P, 2, n), and the parameters of these (P,)."""

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


@dataclass(frozen=True, slots=True)
class RestrictedLikelihood:
    """The restricted log likelihood, up to its constant, as a function of a noise vector (7,).

    The sensitivities have been combined linearly to be orthonormal under white noise; `log_size` is the logarithm of the
    determinant of the inverse combination. Without that, the normal matrix of nearly dependent sensitivities would square their
    condition number, and the rounding errors of the likelihood would spoil its differences. Source: Patterson and Thompson 1971,
    Biometrika 58(3); Golub and Van Loan 2013, section 5.3.8, on normal equations.
    """

    lines: list[LinearisedRun]
    count: int
    log_size: float

    def __call__(self, noise: FloatArray) -> float:
        """Return the restricted log likelihood at a noise vector (7,)."""
        square, logs = whitened_products(self.lines, self.count, noise)
        normal, projection = square[1:, 1:], square[1:, 0]
        left = square[0, 0] - projection @ np.linalg.solve(normal, projection)
        return -0.5 * (logs + float(left + np.linalg.slogdet(normal)[1]) + 2.0 * self.log_size)


@np.errstate(over="ignore", invalid="ignore")  # of a motion without bound, whose noise `estimate_noise` refuses
def restricted_likelihood(lines: list[LinearisedRun], count: int) -> RestrictedLikelihood:
    """Return the restricted likelihood of linearised runs with `count` parameters, without those that have no information.

    The sensitivities of each run to its own parameters are made orthonormal first. They are projected out of the sensitivities to
    the parameters that runs share, which are then made orthonormal over all runs.
    """
    runs_of = np.bincount(np.concatenate([line.place for line in lines]), minlength=count)
    shared = np.flatnonzero(runs_of > 1)
    weights = _channel_weights(lines)
    own_stacks, common, logs = [], [], 0.0
    for line in lines:
        is_own = runs_of[line.place] == 1
        of_shared = np.zeros((shared.size, *line.stack.shape[1:]))
        of_shared[np.searchsorted(shared, line.place[~is_own])] = line.stack[1:][~is_own]
        weighted = [
            (s * line.record.ok * weights[:, None]).reshape(s.shape[0], line.residual.size).T
            for s in (line.stack[1:][is_own], of_shared)
        ]
        sizes = np.linalg.norm(weighted[1], axis=0)
        inverse, size = _orthonormal(weighted[0], np.linalg.norm(weighted[0], axis=0))
        basis = weighted[0] @ inverse
        for _ in range(2):  # the second pass removes the rounding errors of the first
            share = basis.T @ weighted[1]
            weighted[1], of_shared = (
                weighted[1] - basis @ share,
                of_shared - np.tensordot((inverse @ share).T, line.stack[1:][is_own], 1),
            )
        own_stacks.append(np.tensordot(inverse.T, line.stack[1:][is_own], 1))
        common.append((of_shared, weighted[1], sizes))
        logs += size
    inverse, size = _orthonormal(np.concatenate([w for _, w, _ in common]), np.sqrt(sum(s**2 for _, _, s in common)))
    last, combined = inverse.shape[1], []
    for line, own, (of_shared, _, _) in zip(lines, own_stacks, common, strict=True):
        place = np.concatenate([np.arange(last, last + len(own)), np.arange(inverse.shape[1])])
        stack = np.concatenate([line.stack[:1], own, np.tensordot(inverse.T, of_shared, 1)])
        combined.append(replace(line, stack=stack, place=place))
        last += len(own)
    return RestrictedLikelihood(combined, last, logs + size)


def _channel_weights(lines: list[LinearisedRun]) -> FloatArray:
    """Return the inverse of the root mean square residual of each channel (2,), over all runs."""
    squares = np.array([(line.residual**2 * line.record.ok).sum(axis=1) for line in lines]).sum(axis=0)
    counts = np.array([line.record.ok.sum(axis=1) for line in lines]).sum(axis=0)
    return np.asarray(np.sqrt(np.maximum(counts, 1) / np.maximum(squares, np.finfo(float).tiny)))


def _orthonormal(columns: FloatArray, sizes: FloatArray) -> tuple[FloatArray, float]:
    """Return the matrix (P, Q) that makes columns (m, P) orthonormal, and the log determinant of its inverse.

    A column whose norm after projection on the others is below MIN_INFORMATION_SHARE of its size is left out.
    """
    upper = np.asarray(np.linalg.qr(columns, mode="r"))
    left = np.concatenate([np.abs(np.diag(upper)), np.zeros(columns.shape[1] - upper.shape[0])])
    independent = np.flatnonzero(left > MIN_INFORMATION_SHARE * sizes)
    if independent.size < columns.shape[1]:
        upper = np.asarray(np.linalg.qr(columns[:, independent], mode="r"))
    inverse = np.zeros((columns.shape[1], independent.size))
    inverse[independent] = solve_triangular(upper, np.eye(independent.size))
    return inverse, float(np.log(np.abs(np.diag(upper))).sum())


def gls_step(lines: list[LinearisedRun], count: int, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the step (F,) to the generalised least-squares estimate under a noise vector (7,), and its covariance (F, F)."""
    square, _ = whitened_products(lines, count, noise)
    inverse = covariance(square[1:, 1:])
    return inverse @ square[1:, 0], inverse


def reml_noise(
    problem: Problem, lines: list[LinearisedRun], likelihood: RestrictedLikelihood, noise_kind: str, start: Noise
) -> tuple[Noise, float]:
    """Return the noise of a kind with the highest restricted likelihood of linearised runs, and that log likelihood."""
    dynamics, residuals = [(line.damping, line.stiffness) for line in lines], [line.residual for line in lines]
    return estimate_noise(
        [line.record for line in lines],
        dynamics,
        residuals,
        noise_kind,
        start,
        likelihood,
        evaluations=problem.evaluations,
    )


def select_noise(problem: Problem, x: FloatArray, start: Noise) -> tuple[str, Noise, float]:
    """Return the noise kind, noise and log likelihood that the residuals at x support, by penalised likelihood.

    Disturbance and sensor colour together are tried only where the innovations under the better one of them are not white.
    """
    problem = problem.first(MAX_NOISE_SAMPLES // len(problem.records))
    lines = linearise_runs(problem, x)
    likelihood = restricted_likelihood(lines, len(problem.layout.parameters))
    found: dict[str, tuple[Noise, float]] = {}

    def penalised_likelihood(noise_kind: str) -> float:
        return found[noise_kind][1] - PENALTY_PER_PARAMETER * len(NOISE_KINDS[noise_kind].fields)

    for noise_kind in NOISE_KINDS:
        if noise_kind == JOINT_NOISE and innovations_are_white(lines, max(found, key=penalised_likelihood), found):
            continue
        found[noise_kind] = reml_noise(problem, lines, likelihood, noise_kind, start)
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
