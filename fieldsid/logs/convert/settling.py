"""Estimate the pole and the final value of a signal behind a first-order lag, by variable projection.

Source: Golub and Pereyra 2003, Inverse Problems 19(2). The code is not compiled, because it is also called for runs in memory,
which must not wait for a compiler.
"""

from __future__ import annotations

import numpy as np

from fieldsid.logs.few_of import MOSTLY
from fieldsid.numerics.arrays import FloatArray

POLES = (1e-3, 20.0)
"""Range in 1/s in which the pole is searched."""


def settling_of(time: FloatArray, values: FloatArray, *, integrated: bool = False) -> tuple[float, float] | None:
    """Return pole (1/s) and final value of a signal (n,), or, with `integrated`, of the rate of an angle (n,).

    Returns None where the pole cannot be identified: a model without a lag leaves less than twice the residual sum of squares.
    """
    from scipy.optimize import minimize_scalar

    if time.size < 4:
        return None
    t = time - time[0]

    def columns(pole: float) -> FloatArray:
        settled = -np.expm1(-pole * t)
        return np.column_stack([np.ones(t.size), t - settled / pole, settled / pole] if integrated else [settled, 1.0 - settled])

    def residual(matrix: FloatArray) -> float:
        return float(np.sum((values - matrix @ np.linalg.lstsq(matrix, values)[0]) ** 2))

    found = minimize_scalar(lambda x: residual(columns(float(np.exp(x)))), bounds=tuple(np.log(POLES).tolist()), method="bounded")
    without_lag = residual(np.column_stack([np.ones(t.size), t]) if integrated else np.ones((t.size, 1)))
    if not found.fun < MOSTLY * without_lag:
        return None
    pole = float(np.exp(found.x))
    coefficients = np.linalg.lstsq(columns(pole), values)[0]
    return pole, float(coefficients[1] if integrated else coefficients[0])
