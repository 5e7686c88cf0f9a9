"""Innovations of a residual: the Kalman filter of the motion that disturbances and coloured sensor noise cause.

State (y, p, w, n_y, n_p), see noise/whiten.py; a noise is a vector (7,) in the order of NOISE_FIELDS.
"""

from __future__ import annotations

import numpy as np

from fieldsid.noise.kalman.univariate import Filter, three_states, with_sensors
from fieldsid.noise.noise_kinds import NOISE_KINDS, NoiseKind
from fieldsid.numerics.arrays import BoolArray, FloatArray

KINDS = tuple((kind, kind.absent) for kind in NOISE_KINDS.values())


def filter_of(noise: FloatArray) -> Filter:
    """Return the filter of a noise vector (7,): with five states where it has a disturbance and coloured sensor noise."""
    return with_sensors if noise[2] > 0.0 and noise[4] + noise[5] > 0.0 else three_states


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
    return filter_of(noise)(steps, ok, a, k, noise[None], series, out, np.empty((1, 2, steps.shape[0] + 1)))
