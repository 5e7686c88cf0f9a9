"""The information of the training runs on a model's parameters: the normal matrix, and the effective sample sizes.

The effective sample size of a parameter is its information over the largest information of one measurement,
    n_j = sum_i e_ij^2 / max_i e_ij^2
with e_j the whitened sensitivity to it less its projection on those to the others: column j of S N^-1, up to a factor. A dead
band acts in the few samples in which the fin crosses it, and under a slow disturbance a constant moment is measured about once a
minute: 5000 samples are not 5000 measurements of either.
Source: Berger, Bayarri and Pericchi 2014, Econometric Reviews 33, The effective sample size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.optimise.levenberg_marquardt import covariance, normal_equations
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.noise.whiten import whiten
from fieldsid.numerics.arrays import FloatArray

FEWEST = 2.0
"""Smallest effective sample size."""


@dataclass(frozen=True, slots=True)
class Information:
    """Normal matrix (N, N) of all parameters, and the effective sample size of each shared one, (S,)."""

    normal: FloatArray
    sample_sizes: FloatArray


def information(problem: Problem, x: FloatArray, noise: Noise) -> Information:
    """Return the information on the parameters at x under a noise model."""
    shared = problem.layout.shared
    sizes: FloatArray = np.full(shared, FEWEST)
    cost, normal, _, results = normal_equations(problem, x, noise, range(x.size))
    if not np.isfinite(cost):
        return Information(normal, sizes)
    directions, total, largest = covariance(normal)[:shared], np.zeros(shared), np.zeros(shared)
    for record, result in zip(problem.records, results, strict=True):
        series = np.tensordot(directions[:, list(result.columns)], result.sensitivity, axes=1)
        white, _ = whiten(record, noise, result.base.damping, result.base.stiffness, series)
        squares = white.reshape(shared, -1) ** 2
        total, largest = total + squares.sum(axis=1), np.maximum(largest, squares.max(axis=1))
    known = largest > 0.0
    sizes[known] = np.maximum(total[known] / largest[known], FEWEST)
    return Information(normal, sizes)
