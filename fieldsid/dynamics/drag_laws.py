"""The drags of a turning hull in closed form, with their derivatives: the cross flow along it, and a power of its rate.

F(alpha, p) = 32 int_{-1/2}^{1/2} (alpha + xi p) |alpha + xi p| xi dxi        (F(0, p) = p |p|)
G(alpha, p) = int_{-1/2}^{1/2} (alpha + xi p) |alpha + xi p| dxi              (G(alpha, 0) = alpha |alpha|)
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.effect import REFERENCE_RATE_RAD_S, ZERO_RATE_RAD_S
from fieldsid.numerics.jit import inner


@inner
def crossflow(alpha: float, p: float) -> tuple[float, float, float]:
    """Return F(alpha, p) and its derivatives by alpha and by p, from the closed form of the integral."""
    if abs(alpha) >= 0.5 * abs(p):
        s = 1.0 if alpha >= 0.0 else -1.0
        return 16.0 / 3.0 * abs(alpha) * p, 16.0 / 3.0 * s * p, 16.0 / 3.0 * abs(alpha)
    s = 1.0 if p >= 0.0 else -1.0
    ratio = alpha / p
    value = s * (p * p + 8.0 * alpha * alpha - 16.0 / 3.0 * alpha * alpha * ratio * ratio)
    by_alpha = s * (16.0 * alpha - 64.0 / 3.0 * alpha * ratio * ratio)
    by_p = s * (2.0 * p + 32.0 / 3.0 * alpha * ratio * ratio * ratio)
    return value, by_alpha, by_p


@inner
def crossforce(alpha: float, p: float) -> tuple[float, float, float]:
    """Return G(alpha, p) and its derivatives by alpha and by p, from the closed form of the integral."""
    if abs(alpha) >= 0.5 * abs(p):
        s = 1.0 if alpha >= 0.0 else -1.0
        return s * (alpha * alpha + p * p / 12.0), 2.0 * abs(alpha), s * p / 6.0
    s, ratio = (1.0 if p >= 0.0 else -1.0), alpha / p
    cube = 2.0 / 3.0 * alpha * ratio
    return s * (0.5 * alpha * p + cube * alpha), s * (0.5 * p + 3.0 * cube), s * (0.5 * alpha - cube * ratio)


@inner
def power_drag(p: float, beyond: float) -> tuple[float, float]:
    """Return p|p| (|p|/ORDINARY)^beyond and its logarithmic derivative by `beyond`; both are nil at rest."""
    if abs(p) < ZERO_RATE_RAD_S:
        return 0.0, 0.0
    log = np.log(abs(p) / REFERENCE_RATE_RAD_S)
    return p * abs(p) * np.exp(beyond * log), log
