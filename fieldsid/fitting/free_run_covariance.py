"""The covariance of an output-error estimate whose residuals have the colour of a noise model: N^-1 (J' W S W J) N^-1."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.fitting.descent import Descent, normal_equations, sandwich
from fieldsid.fitting.problem import Problem, RunResult
from fieldsid.fitting.uncertainty import middle
from fieldsid.fitting.whitening import noise_vector
from fieldsid.logs.run import FloatArray
from fieldsid.models.model import Noise


def coloured_covariance(problem: Problem, found: Descent, weights: Noise, noise: Noise) -> FloatArray:
    """Return the covariance (F, F) of an output-error estimate under a noise model of any colour."""
    _, normal, _, results = normal_equations(problem, found.x, weights, found.free)
    return corrected(problem, found, weights, noise_vector(noise), normal, results)


def corrected(
    problem: Problem, found: Descent, weights: Noise, noise: FloatArray, normal: FloatArray, results: Sequence[RunResult]
) -> FloatArray:
    """Return that covariance (F, F) under a noise vector (7,), from the normal matrix and the runs' linearisations there."""
    sigma = np.array([weights.angle, weights.rate])
    place = {slot: i for i, slot in enumerate(found.free)}
    centre = np.zeros_like(normal)
    for record, result in zip(problem.records, results, strict=True):
        weighted = np.where(record.ok, result.sensitivity / sigma[:, None] ** 2, 0.0)
        index = np.array([place[s] for s in result.slots])
        centre[np.ix_(index, index)] += middle(record, noise, result.base.damping, result.base.stiffness, weighted)
    return sandwich(normal, centre)
