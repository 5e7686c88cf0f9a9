"""An information matrix corrected by secants: by how much the score has fallen over the last steps.

The expected information is the curvature of a log likelihood where the model is right. Where it is not, as of the noise of a
model that lacks an effect, the likelihood bends less, and scoring by the expected information alone takes tens of small steps.
Source: Nocedal and Wright 2006, equation 6.19 (BFGS), from the expected information at the last point instead of a constant.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.numerics.arrays import FloatArray

CURVATURE_SHARES = (0.01, 0.8)
"""Curvature over a step, in that of the matrix it corrects, between which a secant counts: below, the matrix would become
singular; above, the expected information is as good."""
MAX_STEP = 0.5
"""Longest step whose secant says what the curvature is at its end, where parameters are logarithms."""


def with_secants(information: FloatArray, secants: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """Return an information matrix (P, P) that meets the last of some secants, and the earlier ones as far as that lets it.

    Each is a step (P,) of logarithms and the fall (P,) of the score over it, the oldest first. The matrix stays positive
    definite.
    """
    out, (least, most) = information, CURVATURE_SHARES
    for step, fall in secants:
        along = out @ step
        expected, seen = float(step @ along), float(step @ fall)
        if float(np.abs(step).max()) < MAX_STEP and least * expected < seen < most * expected:
            out = out - np.outer(along, along) / expected + np.outer(fall, fall) / seen
    return np.asarray(out)
