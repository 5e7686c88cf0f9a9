"""The effect of white sample noise on the filtered equation of motion: its transfer to the residual, and the bias it causes.

The noise n of the samples is interpolated linearly and filtered like the signal. At equal steps it enters the residual of the
equation as lambda (s + a)/(s + lambda) n, or lambda^2 (s^2 + a s + k)/(s + lambda)^2 n for the angle alone; here these are
rational functions of the shift q. The same noise is in the regressors: where its variance is known, its contribution to the
normal equations can be subtracted. Source: Soderstrom 2018, Errors-in-Variables Methods in System Identification, chapter 6
(bias-compensated least squares).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.regression.state_variable_filter import filtered, hold_weights
from fieldsid.fitting.regression.svf_equation import RegressionParameters
from fieldsid.numerics.arrays import FloatArray

MIN_INVERSE_CORNER_RAD_S = 0.1
"""Corner (rad/s) below which the inverse transfer is cut off: there noise and start terms cannot be separated."""


@dataclass(frozen=True, slots=True)
class Transfer:
    """Numerator and denominator in q^-1 from sample noise to the equation's residual."""

    numerator: FloatArray
    denominator: FloatArray


@dataclass(frozen=True, slots=True)
class NoiseShare:
    """Contribution of white noise to a row's products: gram (4, 4) of the columns, cross (4,) of columns and target."""

    gram: FloatArray
    cross: FloatArray


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


def noise_share(order: int, bandwidth: float, h: float, angle: float, rate: float) -> NoiseShare:
    """Return the contribution of white noise of standard deviation angle (rad) and rate (rad/s) to a row's products."""
    impulse = np.zeros(max(64, int(12.0 / (bandwidth * h))))
    impulse[0] = 1.0
    g1, g2 = filtered(np.full(impulse.size, h), np.append(0.0, impulse[:-1]), impulse, bandwidth)[1:].T
    gram, cross = np.zeros((4, 4)), np.zeros(4)
    if order == 1:
        power = bandwidth**2 * float(g1 @ g1)
        gram[0, 0], gram[1, 1] = rate**2 * power, angle**2 * power
        cross[0] = -(rate**2) * bandwidth**2 * float(g1 @ (impulse - bandwidth * g1))
        return NoiseShare(gram, cross)
    rows = -(bandwidth**2) * np.stack([g1 - bandwidth * g2, g2])
    target = bandwidth**2 * (impulse - 2.0 * bandwidth * g1 + bandwidth**2 * g2)
    gram[:2, :2] = angle**2 * rows @ rows.T
    cross[:2] = angle**2 * rows @ target
    return NoiseShare(gram, cross)


def noise_can_go(normal: FloatArray, gram: FloatArray) -> bool:
    """Whether noise, whose contribution is gram (P, P), makes up less than half of a normal matrix (P, P) in every direction."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    least = [float(np.linalg.eigvalsh(m * np.outer(scale, scale))[0]) for m in (normal - gram, normal)]
    return least[0] > 0.5 * least[1]


def inverse_of_normal(normal: FloatArray, gram: FloatArray) -> FloatArray:
    """Return the inverse of a normal matrix (P, P) less the contribution of noise, where that is small enough to subtract."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    clean = normal - gram if noise_can_go(normal, gram) else normal
    inverse = np.linalg.pinv(clean * np.outer(scale, scale), rcond=1e-13, hermitian=True)
    return np.asarray(inverse * np.outer(scale, scale), dtype=np.float64)
