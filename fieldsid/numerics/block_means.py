"""Means over successive blocks of samples: they reduce white noise by the root of the block length, but not slow motion."""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.arrays import FloatArray


def block_means(values: FloatArray, width: int) -> FloatArray:
    """Return the means of successive blocks of `width` samples, (n // width,), without an incomplete last one."""
    count = values.size // width
    return np.asarray(values[: count * width].reshape(count, width).mean(axis=1))


def block_width(steps: FloatArray, seconds: float) -> int:
    """Return the number of samples in a block of `seconds`, at least one; steps (n-1,) are the sampling intervals in s."""
    return max(1, round(seconds / float(np.median(steps))))
