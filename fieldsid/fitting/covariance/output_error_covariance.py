"""The covariance of an output-error estimate whose white weights are not the inverse of the noise: the sandwich formula.

    P = N^-1 (sum over runs of J' W S W J) N^-1,  N = J' W J,

with Jacobian J, weights W and the covariance S of coloured noise. A random moment of each run, of standard deviation s, adds s^2
r r' to S, where r is the response to a unit moment. Source: Ljung 1999, section 9.4.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.fitting.optimise.levenberg_marquardt import Minimum, normal_equations, sandwich
from fieldsid.fitting.problem.problem import Problem, RunResult
from fieldsid.models.model import Noise
from fieldsid.noise.moment_response import base_responses
from fieldsid.noise.sandwich_covariance import score_covariance
from fieldsid.noise.whiten import base_dynamics, noise_vector
from fieldsid.numerics.arrays import FloatArray


def coloured_covariance(problem: Problem, found: Minimum, weights: Noise, noise: Noise) -> FloatArray:
    """Return the covariance (F, F) of an output-error estimate under a noise model of any colour."""
    _, normal, _, results = normal_equations(problem, found.x, weights, found.free)
    return white_weight_covariance(problem, found, weights, noise_vector(noise), normal, results, noise.own_moment)


def white_weight_covariance(
    problem: Problem, found: Minimum, weights: Noise, noise: FloatArray, normal: FloatArray, results: Sequence[RunResult],
    own_moment: float = 0.0,
) -> FloatArray:  # fmt: skip
    """Return the covariance (F, F) of an estimate under a noise vector (7,); normal and results are those at the minimum.

    own_moment is the standard deviation of the random moment of each run, rad/s^2.
    """
    sigma = np.array([weights.angle, weights.rate])
    place = {slot: i for i, slot in enumerate(found.free)}
    centre = np.zeros_like(normal)
    for record, result in zip(problem.records, results, strict=True):
        weighted = np.where(record.ok, result.sensitivity / sigma[:, None] ** 2, 0.0)
        index = np.array([place[s] for s in result.columns])
        damping, stiffness = result.base.damping, result.base.stiffness
        centre[np.ix_(index, index)] += score_covariance(record, noise, damping, stiffness, weighted)
        if own_moment > 0.0:
            response = base_responses(record.nominal_steps, *base_dynamics(damping, stiffness))[0]
            moved = own_moment * np.tensordot(weighted, response, axes=2)
            centre[np.ix_(index, index)] += np.outer(moved, moved)
    return sandwich(normal, centre)
