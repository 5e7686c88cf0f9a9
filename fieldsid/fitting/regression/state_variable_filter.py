"""State variable filter: signals filtered by 1/(s + lambda) and 1/(s + lambda)^2, exact for their shape between samples.

Over an interval of length h, seen back from its end (tau = h - s), a signal is u(tau) = u_e - (u_e - u_s) tau / h
- c tau (h - tau) / 2: linear from u_s to u_e with curvature c. A zero-order hold has u_s = u_e and c = 0; a
measurement is straight, and parabolic where a model tells its curvature. Any step lengths. Source: the paper,
"state variable filter"; Garnier and Wang 2008, Identification of Continuous-time Models, chapter 1.
"""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def hold_weights(bandwidth: float, h: float) -> tuple[float, float, float, float, float]:
    """Return exp(-lambda h) and the integrals of tau^j exp(-lambda tau) over 0..h, j = 0..3."""
    fade = np.exp(-bandwidth * h)
    j0 = -np.expm1(-bandwidth * h) / bandwidth
    j1 = (j0 - h * fade) / bandwidth
    j2 = (2.0 * j1 - h * h * fade) / bandwidth
    j3 = (3.0 * j2 - h * h * h * fade) / bandwidth
    return fade, j0, j1, j2, j3


@jit
def advance(
    x1: float, x2: float, start: float, end: float, curvature: float, h: float, weights: tuple[float, float, float, float, float]
) -> tuple[float, float]:
    """Return both filter states an interval later."""
    fade, j0, j1, j2, j3 = weights
    slope, bow = (end - start) / h, 0.5 * curvature
    first = fade * x1 + end * j0 - slope * j1 - bow * (h * j1 - j2)
    second = fade * (x2 + h * x1) + end * j1 - slope * j2 - bow * (h * j2 - j3)
    return first, second


@jit
def _fill(
    steps: FloatArray, start: FloatArray, end: FloatArray, curvature: FloatArray, bandwidth: float, out: FloatArray
) -> None:
    out[0, 0] = out[0, 1] = 0.0
    h = steps[0]
    weights = hold_weights(bandwidth, h)
    for i in range(steps.shape[0]):
        if steps[i] != h:
            h = steps[i]
            weights = hold_weights(bandwidth, h)
        out[i + 1, 0], out[i + 1, 1] = advance(out[i, 0], out[i, 1], start[i], end[i], curvature[i], h, weights)


def filtered(
    steps: FloatArray, start: FloatArray, end: FloatArray, bandwidth: float, curvature: FloatArray | None = None
) -> FloatArray:
    """Return the signal through 1/(s + lambda) and 1/(s + lambda)^2, (n, 2), from rest.

    steps, start, end and curvature are (n-1,) over the intervals, bandwidth is lambda in rad/s.
    """
    out = np.empty((steps.size + 1, 2))
    bow = np.zeros(steps.size) if curvature is None else curvature
    _fill(steps, np.ascontiguousarray(start), np.ascontiguousarray(end), np.ascontiguousarray(bow), bandwidth, out)
    return out
