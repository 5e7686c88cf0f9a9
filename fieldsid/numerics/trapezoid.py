"""The integral of a sampled signal, by the trapezoidal rule."""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.arrays import FloatArray


def trapezoid_integral(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the integral (n,) from the first sample on of a signal (n,) at times (n,) s, straight between its samples."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])
