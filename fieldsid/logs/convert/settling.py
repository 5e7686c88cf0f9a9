"""What a signal behind a first-order lag settles to, and how fast, by variable projection.

Source: Golub and Pereyra 2003, Inverse Problems 19(2). Nothing is compiled here: a run in memory asks it.
"""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.arrays import FloatArray

POLES = (1e-3, 20.0)
"""Poles in 1/s that are looked through."""
TOLD = 0.5
"""Share of the squares left by a signal that settles at once, below which it is told how fast it does."""


def settling_of(time: FloatArray, values: FloatArray, *, integrated: bool = False) -> tuple[float, float] | None:
    """Return pole (1/s) and end of a signal (n,), or of the rate of an angle (n,); None where they cannot be told."""
    from scipy.optimize import minimize_scalar

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
