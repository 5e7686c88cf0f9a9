"""A first-order lag, x' = (u - x) / tau: exact where u is linear between samples, or a zero-order hold."""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def first_order_lag(steps: FloatArray, values: FloatArray, lag: float) -> FloatArray:
    """Return a signal (n,), linear between samples `steps` (n-1,) s apart, after a first-order lag in s, from steady state."""
    out = np.empty(values.shape[0])
    out[0] = values[0]
    for i in range(steps.shape[0]):
        h = steps[i]
        slope = (values[i + 1] - values[i]) / h
        line = values[i] - slope * lag
        out[i + 1] = line + slope * h + (out[i] - line) * np.exp(-h / lag)
    return out


@jit
def held_first_order_lag(values: FloatArray, decay: FloatArray, start: float) -> FloatArray:
    """Return a zero-order-hold signal (m,) after a first-order lag, (m + 1,).

    It is x[i + 1] = decay[i] x[i] + (1 - decay[i]) values[i]; decay (m,) is exp(-step / lag) of each interval; start is x[0].
    """
    out = np.empty(values.shape[0] + 1)
    out[0] = start
    for i in range(values.shape[0]):
        out[i + 1] = decay[i] * out[i] + (1.0 - decay[i]) * values[i]
    return out
