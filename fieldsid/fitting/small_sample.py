"""What not knowing the noise exactly adds to standard errors: the correction of Kenward and Roger, and Student's t.

The noise numbers (log scale) have covariance W, the inverse curvature of their likelihood. A variance v(noise) is then
known as with nu = 2 v^2 / (g' W g) degrees of freedom, g its gradient; and the estimate moves with the noise assumed.
Errors are given so that 1.96 of them make the 95 % interval. Source: Kenward and Roger 1997, Biometrics 53(3).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
from scipy.special import stdtrit

from fieldsid.fitting.noise import FAMILIES
from fieldsid.fitting.whitening import NOISE_FIELDS
from fieldsid.logs.run import FloatArray

STEP = 0.05
"""Half width of differences by the log of a noise number."""
LEAST_CURVATURE = 0.5
"""A noise number whose likelihood is flatter than this is taken as known to a factor of 4 (one standard deviation)."""
FEWEST_DEGREES = 4.0
FEWEST_DEGREES_PLAIN = 12.0
"""The same for estimates that do not use the noise found: 200 seeds of the paper's pulses cover 98 % with fewer."""
LONG = 20_000
"""Samples from which on the noise counts as known."""


def noise_spread(likelihood: Callable[[FloatArray], float], noise: FloatArray, family: str) -> FloatArray:
    """Return the covariance (p, p) of the logs of a family's noise numbers, at a noise vector (7,)."""
    names = FAMILIES[family]

    def at(*moves: tuple[int, float]) -> float:
        return likelihood(moved(noise, names, moves))

    count, centre = len(names), at()
    up, down = [at((i, STEP)) for i in range(count)], [at((i, -STEP)) for i in range(count)]
    curvature = np.diag([2.0 * centre - u - d for u, d in zip(up, down, strict=True)])
    for i, j in combinations(range(count), 2):
        both = at((i, STEP), (j, STEP)) + at((i, -STEP), (j, -STEP)) + 2.0 * centre
        curvature[i, j] = curvature[j, i] = 0.5 * (up[i] + up[j] + down[i] + down[j] - both)
    values, vectors = np.linalg.eigh(curvature / STEP**2)
    return np.asarray((vectors / np.maximum(values, LEAST_CURVATURE)) @ vectors.T)


def moved(noise: FloatArray, names: tuple[str, ...], moves: tuple[tuple[int, float], ...]) -> FloatArray:
    """Return a noise vector (7,) with the logs of some of its named numbers moved."""
    out = noise.copy()
    for index, step in moves:
        out[NOISE_FIELDS.index(names[index])] *= np.exp(step)
    return out


def widened(
    found: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    noise: FloatArray,
    family: str,
    spread: FloatArray,
    fewest: float = FEWEST_DEGREES,
) -> FloatArray:
    """Return the covariance (F, F) of an estimate with what not knowing the noise adds.

    found(noise vector) gives the estimate (F,) that the noise leads to and its covariance (F, F); spread is the
    covariance of the logs of the noise numbers, fewest the least degrees of freedom a variance is given.
    """
    names = FAMILIES[family]
    slopes, gradients = [], []
    for i in range(len(names)):
        (x_up, c_up), (x_down, c_down) = (found(moved(noise, names, ((i, s),))) for s in (STEP, -STEP))
        slopes.append((x_up - x_down) / (2.0 * STEP))
        gradients.append((np.diag(c_up) - np.diag(c_down)) / (2.0 * STEP))
    slope, gradient = np.array(slopes), np.array(gradients)
    covariance = found(noise)[1]
    variance = np.diag(covariance)
    doubt = np.einsum("if,ij,jf->f", gradient, spread, gradient)
    degrees = np.maximum(2.0 * variance**2 / np.maximum(doubt, 1e-300), fewest)
    ratio = np.asarray(stdtrit(degrees, 0.975)) / 1.959964
    total = covariance + 2.0 * slope.T @ spread @ slope
    return np.asarray(total * np.outer(ratio, ratio))
