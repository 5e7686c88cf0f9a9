"""An information matrix corrected by secants: by the change of the score over the last steps.

The expected information is the curvature of the log likelihood where the model is right. Where the model lacks an effect, the
curvature is smaller, and scoring by the expected information alone takes tens of small steps.
Source: Nocedal and Wright 2006, equation 6.19 (BFGS), from the expected information at the last point instead of a constant.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.numerics.arrays import FloatArray

CURVATURE_SHARES = (0.01, 0.8)
"""Limits of the curvature along a step, relative to that of the matrix, between which a secant is used: below, the corrected
matrix would be nearly singular; above, the expected information is good enough."""
MAX_STEP = 0.5
"""Longest step, in logarithms of the parameters, whose secant is used: beyond it the curvature changes along the step."""


def with_secants(information: FloatArray, secants: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """Return an information matrix (P, P) that satisfies the last secant exactly and the earlier ones approximately.

    A secant is a step (P,) of logarithms and the decrease (P,) of the score over it; the oldest is first. The matrix stays
    positive definite.
    """
    out, (least, most) = information, CURVATURE_SHARES
    for step, fall in secants:
        along = out @ step
        expected, seen = float(step @ along), float(step @ fall)
        if float(np.abs(step).max()) < MAX_STEP and least * expected < seen < most * expected:
            out = out - np.outer(along, along) / expected + np.outer(fall, fall) / seen
    return np.asarray(out)
