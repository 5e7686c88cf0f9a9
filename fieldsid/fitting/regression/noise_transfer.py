"""The transfer of white sample noise to the residual of the filtered equation of motion.

The noise n of the samples is interpolated linearly and filtered like the signal. At equal steps it enters the residual of the
equation as lambda (s + a)/(s + lambda) n, or lambda^2 (s^2 + a s + k)/(s + lambda)^2 n for the angle alone; here these are
rational functions of the shift q. Source: Garnier and Wang 2008, Identification of Continuous-time Models, chapter 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.regression.state_variable_filter import hold_weights
from fieldsid.fitting.regression.svf_equation import RegressionParameters
from fieldsid.numerics.arrays import FloatArray

MIN_INVERSE_CORNER_RAD_S = 0.1
"""Corner (rad/s) below which the inverse transfer is cut off: there noise and start terms cannot be separated."""


@dataclass(frozen=True, slots=True)
class Transfer:
    """Numerator and denominator in q^-1 from sample noise to the equation's residual."""

    numerator: FloatArray
    denominator: FloatArray


def filter_polynomials(bandwidth: float, h: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return numerators (3,) of x1 and x2 for straight lines between samples, and their denominator (1 - E q^-1)^2."""
    fade, j0, j1, j2, _ = hold_weights(bandwidth, h)
    pole = np.array([1.0, -fade])
    first = np.array([j0 - j1 / h, j1 / h])
    second = np.convolve(np.array([0.0, h * fade]), first) + np.convolve(np.array([j1 - j2 / h, j2 / h]), pole)
    return np.convolve(first, pole), second, np.convolve(pole, pole)


def transfer_of(order: int, bandwidth: float, h: float, theta: RegressionParameters) -> Transfer:
    """Return the transfer from noise of the rate (order 1) or the angle (order 2) to the residual."""
    one, two, pole = filter_polynomials(bandwidth, h)
    if order == 1:
        return Transfer(bandwidth * (pole + (theta.damping - bandwidth) * one), pole)
    slope = one - bandwidth * two
    bend = pole - 2.0 * bandwidth * one + bandwidth**2 * two
    return Transfer(bandwidth**2 * (bend + theta.damping * slope + theta.stiffness * two), pole)


def inverse_of(transfer: Transfer, h: float) -> Transfer:
    """Return the stable inverse: zeros on or beyond the unit circle are moved to just inside of it."""
    roots = np.roots(transfer.numerator)
    limit = np.exp(-MIN_INVERSE_CORNER_RAD_S * h)
    size = np.abs(roots)
    roots = np.where(size > limit, roots / np.maximum(size, 1e-12) * limit, roots)
    stable = transfer.numerator[0] * np.real(np.poly(roots))
    return Transfer(transfer.denominator, stable)
