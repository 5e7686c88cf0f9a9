"""A signal behind a first-order lag, exact where it is straight between samples."""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def first_order_lag(steps: FloatArray, values: FloatArray, lag: float) -> FloatArray:
    """Return a signal (n,), straight between samples `steps` (n-1,) s apart, seen through a first-order lag in s from rest."""
    out = np.empty(values.shape[0])
    out[0] = values[0]
    for i in range(steps.shape[0]):
        h = steps[i]
        slope = (values[i + 1] - values[i]) / h
        line = values[i] - slope * lag
        out[i + 1] = line + slope * h + (out[i] - line) * np.exp(-h / lag)
    return out
