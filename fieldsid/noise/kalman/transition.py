"""What the compiled filters have in common: how (y, p) goes over an interval, and when gains have settled."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner

STEADY_GAIN_STEPS = 4
"""Steps in a row that leave the gains as they are, after which they are kept."""


@inner
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


@inner
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


@inner
def gains_repeat(gain: float, last: float) -> bool:
    """Whether a gain is what it was at the sample before."""
    return abs(gain - last) < 1e-7 * (abs(gain) + 1e-6)


@inner
def steady_until(steps: FloatArray, ok: npt.NDArray[np.bool_], first: int, h: float) -> int:
    """Return the first sample from `first` on that is not measured in full or not followed by a step of h."""
    n = steps.shape[0] + 1
    i = first
    while i < n and ok[0, i] and ok[1, i] and (i == n - 1 or abs(steps[i] - h) <= 1e-7 * h):
        i += 1
    return i


@inner
def hold_gains(spreads: FloatArray, first: int, stop: int, spread: float) -> float:
    """Fill a channel's spreads over samples first..stop - 1, where they stay, and return the sum of their log variances."""
    for i in range(first, stop):
        spreads[i] = spread
    return 2.0 * (stop - first) * float(np.log(spread))
