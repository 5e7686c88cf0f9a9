"""The covariance of an output-error estimate whose white weights are not the inverse of the noise: the sandwich formula.

    P = N^-1 (sum over runs of J' W S W J) N^-1,  N = J' W J,

with Jacobian J, weights W and the covariance S of coloured noise. Source: Ljung 1999, section 9.4.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.fitting.optimise.levenberg_marquardt import Minimum, normal_equations, sandwich
from fieldsid.fitting.problem.problem import Problem, RunResult
from fieldsid.models.model import Noise
from fieldsid.noise.sandwich_covariance import score_covariance
from fieldsid.noise.whiten import noise_vector
from fieldsid.numerics.arrays import FloatArray


def coloured_covariance(problem: Problem, found: Minimum, weights: Noise, noise: Noise) -> FloatArray:
    """Return the covariance (F, F) of an output-error estimate under a noise model of any colour."""
    _, normal, _, results = normal_equations(problem, found.x, weights, found.free)
    return white_weight_covariance(problem, found, weights, noise_vector(noise), normal, results)


def white_weight_covariance(
    problem: Problem, found: Minimum, weights: Noise, noise: FloatArray, normal: FloatArray, results: Sequence[RunResult]
) -> FloatArray:
    """Return the covariance (F, F) of an estimate under a noise vector (7,); normal and results are those at the minimum."""
    sigma = np.array([weights.angle, weights.rate])
    place = {slot: i for i, slot in enumerate(found.free)}
    centre = np.zeros_like(normal)
    for record, result in zip(problem.records, results, strict=True):
        weighted = np.where(record.ok, result.sensitivity / sigma[:, None] ** 2, 0.0)
        index = np.array([place[s] for s in result.columns])
        centre[np.ix_(index, index)] += score_covariance(record, noise, result.base.damping, result.base.stiffness, weighted)
    return sandwich(normal, centre)
