"""Prediction error: the free run plus a Kalman filter for a disturbance moment and coloured sensor noise.

It alternates generalised least squares under the current noise model with maximum likelihood of the noise model for the new
residuals. It is efficient under a disturbance, where output error is not. Source: Ljung 1999, chapter 7.
"""

from __future__ import annotations

import numpy as np

from fieldsid.estimators.output_error import found_minimum
from fieldsid.fitting.covariance.kenward_roger import KNOWN_NOISE_SAMPLES, kenward_roger, noise_covariance
from fieldsid.fitting.covariance.reml import (
    MAX_NOISE_SAMPLES,
    gls_step,
    linearise_runs,
    reml_noise,
    restricted_likelihood,
    select_noise,
)
from fieldsid.fitting.optimise.levenberg_marquardt import Minimum, covariance, levenberg_marquardt
from fieldsid.fitting.optimise.residual_weights import residual_noise
from fieldsid.fitting.problem.estimator import Estimator, Options, Solution, shared_covariance
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.model import Noise
from fieldsid.noise.whiten import noise_vector
from fieldsid.numerics.arrays import FloatArray

MAX_ALTERNATIONS = 8
CONVERGED_STD_ERRORS = 1e-2
"""Largest change of a parameter, in standard errors, at which the alternation has converged."""


def solve(problem: Problem, _options: Options) -> Solution:
    """Return the prediction-error solution of a joint problem."""
    found, weights = found_minimum(problem)
    return solve_from(problem, found.x, weights)


def after(problem: Problem, plain: Solution) -> Solution:
    """Return the prediction-error solution that starts from an output-error solution."""
    return solve_from(problem, plain.x, residual_noise(problem, plain.x, len(plain.x)))


def solve_from(problem: Problem, x: FloatArray, weights: Noise) -> Solution:
    """Return the prediction-error solution that starts from an output-error minimum x.

    The kind of noise is selected again after the first descent: where a controller feeds a disturbance back through the fin,
    the output-error minimum is biased, and so are its residuals.
    """
    part = problem.first(MAX_NOISE_SAMPLES // len(problem.records))
    found = levenberg_marquardt(problem, x, select_noise(problem, x, weights)[1])
    noise_kind, noise, _ = select_noise(problem, found.x, weights)
    for _ in range(MAX_ALTERNATIONS):
        before = found.x
        found = levenberg_marquardt(problem, before, noise)
        has_converged = _largest_change(found, before) < CONVERGED_STD_ERRORS
        if has_converged:
            break
        lines = linearise_runs(part, found.x)
        noise, _ = reml_noise(problem, lines, restricted_likelihood(lines, len(problem.layout.parameters)), noise_kind, noise)
    notes = (Note("noise_model", f"noise model: {noise_kind}", {"family": noise_kind}),)
    known = shared_covariance(problem, found.x, errors(problem, found, noise, noise_kind), found.free)
    return Solution(found.x, known, noise, ESTIMATOR.name, notes, weights=noise)


def errors(problem: Problem, found: Minimum, noise: Noise, noise_kind: str) -> FloatArray:
    """Return the covariance (F, F) of the estimate; on short records it allows for the uncertainty of the noise parameters."""
    if noise_kind == "white" or sum(len(r) for r in problem.records) > KNOWN_NOISE_SAMPLES:
        return covariance(found.normal)
    lines, count, vector = linearise_runs(problem, found.x), len(problem.layout.parameters), noise_vector(noise)
    spread = noise_covariance(restricted_likelihood(lines, count), vector, noise_kind)
    return kenward_roger(lambda v: gls_step(lines, count, v), vector, noise_kind, spread)


def _largest_change(found: Minimum, before: FloatArray) -> float:
    """Return the largest change of a free parameter in standard errors."""
    spread = np.sqrt(np.maximum(np.diag(covariance(found.normal)), 0.0))
    return float(np.max(np.abs(found.x - before)[list(found.free)] / np.maximum(spread, 1e-12)))


ESTIMATOR = Estimator(
    name="pem",
    says="output error whitened by a Kalman filter with a disturbance moment and coloured sensor noise",
    source="Ljung 1999, chapter 7",
    solve=solve,
    after=after,
)
