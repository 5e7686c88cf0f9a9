"""Prediction error: the free run plus a Kalman filter for a disturbance moment and coloured sensor noise.

Alternates generalised least squares under the current noise model with the noise model of highest likelihood for
the new residuals. Efficient under a disturbance, where plain output error is not. Source: Ljung 1999, chapter 7.
"""

from __future__ import annotations

import numpy as np

from fieldsid.estimators.output_error import found_minimum
from fieldsid.fitting.descent import Descent, covariance, descend
from fieldsid.fitting.method import Estimator, Options, Solution, shared_covariance
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.restricted import ENOUGH, best_noise, generalised, lines_of, restricted_likelihood, restricted_noise
from fieldsid.fitting.small_sample import LONG, noise_spread, widened
from fieldsid.fitting.whitening import noise_vector
from fieldsid.logs.run import FloatArray, Note
from fieldsid.models.model import Noise

ROUNDS = 8
SETTLED = 1e-2
"""Largest movement, in standard errors, at which noise and parameters count as agreed."""


def solve(problem: Problem, _options: Options) -> Solution:
    """Return the prediction-error solution of a joint problem."""
    found, weights = found_minimum(problem)
    return solve_from(problem, found.x, weights)


def solve_from(problem: Problem, x: FloatArray, weights: Noise) -> Solution:
    """Return the prediction-error solution that an output-error minimum x leads to.

    The family of the noise is chosen again after the first step away from that minimum, whose residuals a
    disturbance fed back through the fin has bent.
    """
    part = problem.first(ENOUGH // len(problem.records))
    found = descend(problem, x, best_noise(problem, x, weights)[1])
    family, noise, _ = best_noise(problem, found.x, weights)
    for _ in range(ROUNDS):
        before = found.x
        found = descend(problem, before, noise)
        settled = _moved(found, before) < SETTLED
        if settled:
            break
        noise, _ = restricted_noise(problem, lines_of(part, found.x), family, noise)
    notes = (Note("noise_model", f"noise model: {family}", {"family": family}),)
    known = shared_covariance(problem, errors(problem, found, noise, family), found.free)
    return Solution(found.x, known, noise, ESTIMATOR.name, notes, weights=noise)


def errors(problem: Problem, found: Descent, noise: Noise, family: str) -> FloatArray:
    """Return the covariance (F, F) of the estimate, allowing on short records for noise that is not known exactly."""
    if family == "white" or sum(len(r) for r in problem.records) > LONG:
        return covariance(found.normal)
    lines, count, vector = lines_of(problem, found.x), len(problem.layout.slots), noise_vector(noise)
    spread = noise_spread(lambda v: restricted_likelihood(lines, count, v), vector, family)
    return widened(lambda v: generalised(lines, count, v), vector, family, spread)


def _moved(found: Descent, before: FloatArray) -> float:
    spread = np.sqrt(np.maximum(np.diag(covariance(found.normal)), 0.0))
    return float(np.max(np.abs(found.x - before)[list(found.free)] / np.maximum(spread, 1e-12)))


ESTIMATOR = Estimator(
    name="pem",
    says="output error whitened by a Kalman filter with a disturbance moment and coloured sensor noise",
    source="Ljung 1999, chapter 7",
    solve=solve,
)
