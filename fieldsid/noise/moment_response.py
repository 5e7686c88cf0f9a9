"""The response of the linear base model to a constant moment, and the whitening of series for a random moment of each run.

The trim varies from run to run: a fin returns to its neutral position within a tenth of a degree, a payload shifts. A constant
moment m ~ N(0, s^2) of one run adds m r to its residual, where r is the response of p' = -a p - k y + 1 from rest. With r
whitened for the other noise, the covariance I becomes I + s^2 r r', whose inverse square root is I - (1 - (1 + s^2 r'r)^-1/2) r
r' / r'r. Source: Woodbury's identity; a variance component of grouped data (Searle, Casella and McCulloch 1992, chapter 1).
"""

from __future__ import annotations

import numpy as np

from fieldsid.noise.kalman.transition import is_other_step, transition
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def base_responses(steps: FloatArray, a: float, k: float) -> FloatArray:
    """Return angle and rate (3, 2, n) of the linear base model: to a unit moment from rest, a unit angle and a unit rate."""
    n, last_h = steps.shape[0] + 1, -1.0
    out = np.zeros((3, 2, n))
    out[1, 0, 0] = out[2, 1, 0] = 1.0
    yy, yp, py, pp, yw, pw = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    for i in range(n - 1):
        if is_other_step(steps[i], last_h):
            last_h = steps[i]
            yy, yp, py, pp, yw, pw = transition(a, k, last_h)
        for row in range(3):
            y, p, w = out[row, 0, i], out[row, 1, i], 1.0 * (row == 0)
            out[row, 0, i + 1] = yy * y + yp * p + yw * w
            out[row, 1, i + 1] = py * y + pp * p + pw * w
    return out


def without_common_moment(white: FloatArray, response: FloatArray, std: float) -> tuple[FloatArray, float]:
    """Return series (m, 2, n), whitened also for a moment of standard deviation std (rad/s^2), and the added log variance.

    `white` are the series and `response` (2, n) the response to a unit moment, both whitened for the other noise.
    """
    power = float(np.vdot(response, response))
    if power <= 0.0:
        return white, 0.0
    variance = 1.0 + std**2 * power
    removed = np.tensordot(white, response, axes=2) * ((1.0 - variance**-0.5) / power)
    return white - removed[:, None, None] * response, float(np.log(variance))
