"""The state that disturbances and coloured noise stir, (y, p, w, n_y, n_p): how it goes over an interval.

See fitting/whitening.py; a noise is a vector (7,) in the order of whitening.NOISE_FIELDS.
"""

from __future__ import annotations

import numpy as np

from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit


@jit
def _taylor(a: float, k: float, s: float, y: float, p: float, w: float) -> tuple[float, float]:
    """Return (y, p) after s under a held moment w, by the series of the exponential to order 8."""
    add_y, add_p, push = y, p, w
    for order in range(1, 9):
        share = s / order
        add_y, add_p = add_p * share, (push - a * add_p - k * add_y) * share
        push = 0.0
        y += add_y
        p += add_p
    return y, p


@jit
def transition(a: float, k: float, h: float) -> tuple[float, float, float, float, float, float]:
    """Return the held-input transition of (y, p) over h: f_yy, f_yp, f_py, f_pp, and what w adds to y and to p."""
    pieces = max(1, int(np.ceil(max(abs(a), np.sqrt(abs(k)), 1e-9) * h / 0.25)))
    s = h / pieces
    yy, yp, py, pp, wy, wp = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    for _ in range(pieces):
        yy, py = _taylor(a, k, s, yy, py, 0.0)
        yp, pp = _taylor(a, k, s, yp, pp, 0.0)
        wy, wp = _taylor(a, k, s, wy, wp, 1.0)
    return yy, yp, py, pp, wy, wp


@jit
def set_transition(a: float, k: float, h: float, noise: FloatArray, f: FloatArray) -> None:
    """Fill f (5, 5) with the transition of (y, p, w, n_y, n_p) over h."""
    f[0, 0], f[0, 1], f[1, 0], f[1, 1], f[0, 2], f[1, 2] = transition(a, k, h)
    f[2, 2] = np.exp(-h / noise[3])
    f[3, 3] = f[4, 4] = np.exp(-h / noise[6])


@jit
def stays(gain: float, last: float) -> bool:
    """Whether a gain is what it was at the sample before."""
    return abs(gain - last) < 1e-7 * (abs(gain) + 1e-6)


@jit
def carry(f: FloatArray, state: FloatArray) -> None:
    """Carry every state (m, 5) over one interval."""
    for j in range(state.shape[0]):
        y, p, w = state[j, 0], state[j, 1], state[j, 2]
        state[j, 0] = f[0, 0] * y + f[0, 1] * p + f[0, 2] * w
        state[j, 1] = f[1, 0] * y + f[1, 1] * p + f[1, 2] * w
        state[j, 2] = f[2, 2] * w
        state[j, 3] *= f[3, 3]
        state[j, 4] *= f[4, 4]
