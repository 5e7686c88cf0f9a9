"""Residual squares of a free run: the weights of output error, and the likelihood by which two fits are compared."""

from __future__ import annotations

import numpy as np

from fieldsid.errors import EffectError
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.noise.white_floor import MIN_ANGLE_NOISE_RAD, MIN_RATE_NOISE_RAD_S, white_noise_floor
from fieldsid.numerics.arrays import FloatArray


def squares_of(problem: Problem, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sum of squared residuals of angle and rate over all runs (2,), and their counts (2,)."""
    squares, counts = np.zeros(2), np.zeros(2)
    for run, record in enumerate(problem.records):
        residual, _ = problem.residual(x, run)
        squares += np.einsum("ij,ij->i", residual, residual)
        counts += (record.angle_ok.sum(), record.rate_ok.sum())
    return squares, counts


def residual_noise(problem: Problem, x: FloatArray, parameters: int) -> Noise:
    """Return the residual standard deviation of both channels, corrected for the number of parameters estimated.

    It has a lower bound: in a log without noise, a channel that the model follows exactly would otherwise have all the weight.
    """
    squares, counts = squares_of(problem, x)
    used_up = parameters * counts / max(float(counts.sum()), 1.0)
    sigma = np.sqrt(squares / np.maximum(counts - used_up, 1.0))
    floor, least = white_noise_floor(problem.records), (MIN_ANGLE_NOISE_RAD, MIN_RATE_NOISE_RAD_S)
    angle, rate = (max(float(v), low) for v, low in zip(sigma, least, strict=True))
    return Noise(angle if sigma[0] > 0 else floor.angle, rate if sigma[1] > 0 else floor.rate)


def white_weights(problem: Problem, x: FloatArray) -> Noise:
    """Return the residual standard deviation of both channels, 1 where a channel was not measured or diverged."""
    squares, counts = squares_of(problem, x)
    sigma = np.sqrt(squares / np.maximum(counts, 1.0))
    sigma = np.where(np.isfinite(sigma) & (squares > 0.0), sigma, 1.0)
    return Noise(float(sigma[0]), float(sigma[1]))


def negative_log_likelihood(problem: Problem, x: FloatArray) -> float:
    """Return minus the log likelihood of white residuals of unknown variance, infinite where x cannot be simulated."""
    try:
        squares, counts = squares_of(problem, x)
    except EffectError:
        return float("inf")
    if not np.isfinite(squares).all():
        return float("inf")
    return float(0.5 * np.sum(counts * np.log(np.maximum(squares, 1e-300) / np.maximum(counts, 1.0))))
