"""Innovations of a residual: the Kalman filter of the motion that disturbances and coloured sensor noise cause.

State (y, p, w, n_y, n_p), see noise/whiten.py; a noise is a vector (7,) in the order of NOISE_FIELDS.
"""

from __future__ import annotations

import numpy as np

from fieldsid.noise.kalman.univariate import kalman_filter
from fieldsid.noise.noise_kinds import NOISE_KINDS, NoiseKind
from fieldsid.numerics.arrays import BoolArray, FloatArray

KINDS = tuple((kind, kind.absent) for kind in NOISE_KINDS.values())


def kind_of(noise: FloatArray) -> NoiseKind:
    """Return the first kind that has all non-zero standard deviations of a noise vector (7,)."""
    sizes = noise.tolist()
    return next(kind for kind, absent in KINDS if not any(sizes[i] for i in absent))


def innovations(
    steps: FloatArray, ok: BoolArray, a: float, k: float, noise: FloatArray, series: FloatArray, out: FloatArray
) -> float:  # fmt: skip
    """Fill out (m, 2, n) with the standardised innovations of series (m, 2, n) under a noise vector (7,).

    Samples that were not measured give zero. Returns the sum of the log variances.
    """
    return kalman_filter(steps, ok, a, k, noise, series, out, np.empty((2, steps.shape[0] + 1)))
