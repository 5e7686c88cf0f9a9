"""Force and moment of the cross flow along a hull of uniform strips, in closed form, arrays alike.

F(a, p) = 32 int_{-1/2}^{1/2} (a + xi p) |a + xi p| xi dxi,   G(a, p) = int_{-1/2}^{1/2} (a + xi p) |a + xi p| dxi
with a the drift over the length and p the rate, both in rad/s: F(0, p) = p |p| and G(a, 0) = a |a|. These are the plain versions
of the kernel's (`dynamics/nonlinear_kernel.py`).
Source: Fossen 2011, section 6.4.3 (cross-flow drag principle).
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.effect import steady_cross_state
from fieldsid.numerics.arrays import FloatArray

NEWTON_STEPS = 12
"""Each doubles the digits once the branch of the closed form is found; the force rises with the drift everywhere."""


def strip_moment(drift: FloatArray, rate: FloatArray) -> FloatArray:
    """Return F in rad^2/s^2 at drifts and rates in rad/s."""
    inside = np.abs(drift) < 0.5 * np.abs(rate)
    ratio = np.where(inside, drift, 0.0) / np.where(inside, rate, 1.0)
    turned = rate * np.abs(rate) * (1.0 + 8.0 * ratio**2 - 16.0 / 3.0 * ratio**4)
    return np.asarray(np.where(inside, turned, 16.0 / 3.0 * np.abs(drift) * rate))


def strip_force(drift: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return G in rad^2/s^2 and its derivative by the drift, at drifts and rates in rad/s."""
    inside = np.abs(drift) < 0.5 * np.abs(rate)
    ratio = np.where(inside, drift, 0.0) / np.where(inside, rate, 1.0)
    size = np.abs(rate)
    force = np.where(inside, drift * size * (0.5 + 2.0 / 3.0 * ratio**2), np.sign(drift) * (drift**2 + rate**2 / 12.0))
    return np.asarray(force), np.asarray(np.where(inside, size * (0.5 + 2.0 * ratio**2), 2.0 * np.abs(drift)))


def settled_cross_state(
    push: FloatArray, rate: FloatArray, damping: FloatArray, quadratic: FloatArray, force: FloatArray, flow: FloatArray
) -> FloatArray:
    """Return the root x of damping x + quadratic x|x| + force G(flow x, rate) = push, arrays alike; damping > 0.

    The left side rises with x everywhere, so that Newton's method has one root to find.
    """
    x = steady_cross_state(push, damping, quadratic + force * flow**2)
    if not np.any(force):
        return x
    for _ in range(NEWTON_STEPS):
        pulled, by_drift = strip_force(flow * x, rate)
        left = damping * x + quadratic * x * np.abs(x) + force * pulled - push
        x = x - left / (damping + 2.0 * quadratic * np.abs(x) + force * flow * by_drift)
    return np.asarray(x)
