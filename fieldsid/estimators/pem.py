"""Prediction error: the free run plus a Kalman filter for a disturbance moment and coloured sensor noise.

Alternates generalised least squares under the current noise model with the noise model of highest likelihood for
the new residuals. Efficient under a disturbance, where plain output error is not. Source: Ljung 1999, chapter 7.
"""

from __future__ import annotations

import numpy as np

from fieldsid.estimators.output_error import minimise
from fieldsid.fitting.colour import best_noise, dynamics_of, residuals_of
from fieldsid.fitting.descent import covariance, descend
from fieldsid.fitting.method import Estimator, Options, Solution, shared_covariance
from fieldsid.fitting.noise import estimate_noise, floor_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.start import start_vector
from fieldsid.logs.run import Note

ROUNDS = 8
SETTLED = 1e-3


def solve(problem: Problem, _options: Options) -> Solution:
    """Return the prediction-error solution of a joint problem."""
    found, weights = minimise(problem, start_vector(problem.records, problem.layout), floor_of(problem.records))
    family, noise, _ = best_noise(problem, found.x, weights)
    for _ in range(ROUNDS):
        before = found.x
        found = descend(problem, before, noise)
        spread = np.sqrt(np.maximum(np.diag(covariance(found.normal)), 0.0))
        moved = np.abs(found.x - before)[list(found.free)] / np.maximum(spread, 1e-12)
        noise, _ = estimate_noise(
            problem.records, dynamics_of(problem, found.x), residuals_of(problem, found.x), family, noise
        )
        if float(moved.max()) < SETTLED:
            break
    notes = (Note("noise_model", f"noise model: {family}", {"family": family}),)
    return Solution(found.x, shared_covariance(problem, covariance(found.normal), found.free), noise, ESTIMATOR.name, notes)


ESTIMATOR = Estimator(
    name="pem",
    says="output error whitened by a Kalman filter with a disturbance moment and coloured sensor noise",
    source="Ljung 1999, chapter 7",
    solve=solve,
)
