"""A signal behind a first-order lag, x' = (u - x) / tau: exact where u is straight, or held, between samples.

And the way back, tau and u of one that settles, by variable projection (Golub and Pereyra 2003, Inverse Problems 19(2)).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit

POLES = (1e-3, 20.0)
"""Poles in 1/s that are looked through."""
TOLD = 0.5
"""Share of the squares left by a signal that settles at once, below which it is told how fast it does."""


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


@jit
def held_first_order_lag(values: FloatArray, kept: FloatArray, start: float) -> FloatArray:
    """Return a held signal (m,) seen through a first-order lag, (m + 1,): x[i + 1] = kept[i] x[i] + (1 - kept[i]) values[i].

    kept (m,) is exp(-step / lag) of each interval; start is x[0].
    """
    out = np.empty(values.shape[0] + 1)
    out[0] = start
    for i in range(values.shape[0]):
        out[i + 1] = kept[i] * out[i] + (1.0 - kept[i]) * values[i]
    return out


def settling_of(time: FloatArray, values: FloatArray, *, integrated: bool = False) -> tuple[float, float] | None:
    """Return pole (1/s) and end of a signal (n,), or of the rate of an angle (n,); None where they cannot be told."""
    if time.size < 4:
        return None
    t = time - time[0]

    def columns(pole: float) -> FloatArray:
        gone = -np.expm1(-pole * t)
        return np.column_stack([np.ones(t.size), t - gone / pole, gone / pole] if integrated else [gone, 1.0 - gone])

    def left(matrix: FloatArray) -> float:
        return float(np.sum((values - matrix @ np.linalg.lstsq(matrix, values)[0]) ** 2))

    found = minimize_scalar(lambda x: left(columns(float(np.exp(x)))), bounds=tuple(np.log(POLES).tolist()), method="bounded")
    at_once = left(np.column_stack([np.ones(t.size), t]) if integrated else np.ones((t.size, 1)))
    if not found.fun < TOLD * at_once:
        return None
    pole = float(np.exp(found.x))
    own = np.linalg.lstsq(columns(pole), values)[0]
    return pole, float(own[1] if integrated else own[0])
