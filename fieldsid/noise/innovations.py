"""Innovations of a residual: the Kalman filter of the motion that disturbances and coloured sensor noise cause.

State (y, p, w, n_y, n_p), see noise/whiten.py; a noise is a vector (7,) in the order of NOISE_FIELDS. The filter is that of the
first kind in NOISE_KINDS that holds all of the noise; each is compiled only once it is called.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.noise.noise_kinds import NOISE_KINDS, Filter, NoiseKind
from fieldsid.numerics.arrays import FloatArray

KINDS = tuple((kind, kind.absent) for kind in NOISE_KINDS.values())


def kalman_filter(
    steps: FloatArray,
    ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    series: FloatArray,
    out: FloatArray,
    spreads: FloatArray,
) -> float:
    """Do what `innovations` does, and fill spreads (2, n) with their standard deviations, one where not measured."""
    return filter_of(noise)(steps, ok, a, k, noise, series, out, spreads)


def filter_of(noise: FloatArray) -> Filter:
    """Return the filter of the first kind that holds all of a noise vector (7,)."""
    return kind_of(noise).filter


def kind_of(noise: FloatArray) -> NoiseKind:
    """Return the first kind that holds all of a noise vector (7,)."""
    sizes = noise.tolist()
    return next(kind for kind, absent in KINDS if not any(sizes[i] for i in absent))


def innovations(
    steps: FloatArray,
    ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    series: FloatArray,
    out: FloatArray,
) -> float:
    """Fill out (m, 2, n) with the standardised innovations of series (m, 2, n); return the sum of log variances.

    Samples not measured give zero. Once four steps in a row of equal length leave the gains as they are, they are kept
    until a sample is missing or the step changes.
    """
    return kalman_filter(steps, ok, a, k, noise, series, out, np.empty((2, steps.shape[0] + 1)))
