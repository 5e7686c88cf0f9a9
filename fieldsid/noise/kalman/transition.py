"""The transition of angle and rate (y, p) of the linear base model over an interval, under a constant moment w."""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.jit import inner

SAME_STEP_SHARE = 1e-7
"""Relative difference within which two steps count as equal: times are rounded."""


@inner
def _taylor(a: float, k: float, s: float, y: float, p: float, w: float) -> tuple[float, float]:
    """Return (y, p) after a time s under a constant moment w, by the Taylor series of the exponential to order 8."""
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
    """Return the zero-order-hold transition of (y, p) over h: f_yy, f_yp, f_py, f_pp, and the gains from w to y and to p."""
    pieces = max(1, int(np.ceil(max(abs(a), np.sqrt(abs(k)), 1e-9) * h / 0.25)))
    s = h / pieces
    yy, yp, py, pp, wy, wp = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    for _ in range(pieces):
        yy, py = _taylor(a, k, s, yy, py, 0.0)
        yp, pp = _taylor(a, k, s, yp, pp, 0.0)
        wy, wp = _taylor(a, k, s, wy, wp, 1.0)
    return yy, yp, py, pp, wy, wp


@inner
def is_other_step(step: float, last: float) -> bool:
    """Whether a step between samples differs from the last one, for which the transition is known."""
    return abs(step - last) > SAME_STEP_SHARE * step
