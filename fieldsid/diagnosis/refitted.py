"""The model of a hypothesis as it is written to a file: the values its free run was judged by, with their covariance."""

from __future__ import annotations

import numpy as np

from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.estimators.output_error import coloured_covariance
from fieldsid.fitting.descent import covariance, descend, normal_equations
from fieldsid.fitting.fit import model_of
from fieldsid.fitting.method import Solution, shared_covariance
from fieldsid.fitting.noise import floor_of
from fieldsid.fitting.predict import refit_own
from fieldsid.fitting.weights import white_weights
from fieldsid.models.model import Model


def refitted_model(h: Hypothesis) -> Model:
    """Return the model whose errors the hypothesis reports.

    That is the generalised least-squares one, or, where plain output error predicted unseen runs better, that one, with the
    covariance it has under the hypothesis's own noise.
    """
    trial, noise = h.judged.trial, h.judged.noise
    problem, layout = trial.problem, trial.problem.layout
    x = trial.x.copy()
    x[: layout.shared] = [h.model.values[n] for n in layout.names]
    if np.array_equal(x, trial.x):
        return _by_likelihood(h)
    for run, record in enumerate(problem.records):
        x = refit_own(problem, x, run, floor_of([record]))
    weights = white_weights(problem, x)
    found = descend(problem, x, weights, rounds=0)
    full = coloured_covariance(problem, found, weights, noise)
    return model_of(problem, Solution(found.x, shared_covariance(problem, full, found.free), noise, "output_error"))


def _by_likelihood(h: Hypothesis) -> Model:
    """Return the model of a hypothesis's generalised least squares."""
    trial, noise = h.judged.trial, h.judged.noise
    slots = tuple(range(len(trial.x)))
    _, normal, _, _ = normal_equations(trial.problem, trial.x, noise, slots)
    solution = Solution(trial.x, shared_covariance(trial.problem, covariance(normal), slots), noise, "pem")
    return model_of(trial.problem, solution)
