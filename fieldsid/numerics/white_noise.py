"""The white noise of a smooth signal, from its k-th differences: a polynomial of degree k - 1 vanishes in them.

White noise of variance s^2 gives them the variance binom(2 k, k) s^2.
"""

from __future__ import annotations

from math import comb

import numpy as np
from scipy.special import ndtri

from fieldsid.numerics.arrays import BoolArray, FloatArray

DIFFERENCE_ORDER = 3
MEDIAN_OF_NORMAL = float(ndtri(0.75))
"""Median of |x| of a standard normal x."""

MAX_FLOOR_SAMPLES, BLOCK_SAMPLES = 50_000, 1_000
"""Samples that determine the floor well enough; of longer records, blocks spread over them are used."""


def white_noise_std(values: FloatArray, ok: BoolArray) -> float:
    """Return the white-noise standard deviation of a smooth signal from its third differences.

    A trimmed mean of their squares excludes the kinks at fin steps. Returns NaN with fewer than 20 of them.
    """
    if values.size > MAX_FLOOR_SAMPLES:
        parts = [
            slice(i, i + BLOCK_SAMPLES)
            for i in range(0, values.size - BLOCK_SAMPLES, values.size * BLOCK_SAMPLES // MAX_FLOOR_SAMPLES)
        ]
        d = np.concatenate([_differences(values[p], ok[p]) for p in parts])
    else:
        d = _differences(values, ok)
    if d.size < 20:
        return float("nan")
    square = np.sort(d * d)
    keep = square[: int(0.9 * square.size)]
    # E[x^2 | x^2 < q90] of a standard normal is 0.5849: the trimmed mean made unbiased
    full, trimmed = float(square.mean()), float(keep.mean()) / 0.5849
    return float(np.sqrt(max(min(full, trimmed), 0.0) / comb(2 * DIFFERENCE_ORDER, DIFFERENCE_ORDER)))


def robust_white_noise_std(differences: FloatArray, order: int) -> float:
    """Return the white-noise standard deviation behind differences (m,) of an order, from the median of their sizes.

    It is less precise than `white_noise_std`, but valid where up to half the differences are jumps, or zero as values are
    repeated.
    """
    return float(np.median(np.abs(differences))) / (MEDIAN_OF_NORMAL * float(np.sqrt(comb(2 * order, order))))


def _differences(values: FloatArray, ok: BoolArray) -> FloatArray:
    """Return the third differences of measured samples that are as far apart as most, also where others lie between them."""
    if ok.all():
        return np.diff(values, DIFFERENCE_ORDER)
    apart = np.diff(np.flatnonzero(ok))
    if apart.size < DIFFERENCE_ORDER:
        return np.zeros(0)
    even = np.lib.stride_tricks.sliding_window_view(apart == int(np.median(apart)), DIFFERENCE_ORDER).all(axis=1)
    return np.diff(values[ok], DIFFERENCE_ORDER)[even]
