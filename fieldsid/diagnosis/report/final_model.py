"""The model that is written to a file: the values of the reported fit, with their covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.fitting.covariance.output_error_covariance import coloured_covariance
from fieldsid.fitting.fit import model_of
from fieldsid.fitting.optimise.levenberg_marquardt import covariance, levenberg_marquardt, normal_equations
from fieldsid.fitting.optimise.residual_weights import white_weights
from fieldsid.fitting.predict.predict import refit_nuisances
from fieldsid.fitting.problem.estimator import Solution, shared_covariance
from fieldsid.models.model import Model, Noise
from fieldsid.noise.white_floor import white_noise_floor


def final_model(h: ScoredModel) -> Model:
    """Return the model whose errors a scored model reports.

    It is the maximum-likelihood model, or the output-error model where that predicts the validation runs better, with its
    covariance under the noise of the maximum-likelihood fit.
    """
    fitted, noise = h.likelihood_fit.fitted, h.likelihood_fit.noise
    return replace(_with_covariance(h, fitted, noise), noise=h.noise)


def _with_covariance(h: ScoredModel, fitted: FittedProblem, noise: Noise) -> Model:
    problem, layout = fitted.problem, fitted.problem.layout
    x = fitted.x.copy()
    x[: layout.shared] = [h.model.values[n] for n in layout.names]
    if np.array_equal(x, fitted.x):
        return _by_likelihood(fitted, noise)
    for run, record in enumerate(problem.records):
        x = refit_nuisances(problem, x, run, white_noise_floor([record]))
    weights = white_weights(problem, x)
    found = levenberg_marquardt(problem, x, weights, max_iterations=0)
    full = coloured_covariance(problem, found, weights, noise)
    return model_of(problem, Solution(found.x, shared_covariance(problem, found.x, full, found.free), noise, "output_error"))


def _by_likelihood(fitted: FittedProblem, noise: Noise) -> Model:
    """Return the model of the maximum-likelihood fit with its covariance."""
    slots = tuple(range(len(fitted.x)))
    _, normal, _, _ = normal_equations(fitted.problem, fitted.x, noise, slots)
    solution = Solution(fitted.x, shared_covariance(fitted.problem, fitted.x, covariance(normal), slots), noise, "pem")
    return model_of(fitted.problem, solution)
