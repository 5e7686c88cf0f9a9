"""Least squares of many rows and few columns, from the columns' products: a hundredth of a decomposition's time."""

from __future__ import annotations

import numpy as np

from fieldsid.logs.run import FloatArray

SINGULAR = 1e-12
"""Share of the largest product's eigenvalue below which a combination of columns is not told from none."""


def least_squares(columns: FloatArray, target: FloatArray) -> FloatArray:
    """Return the least-squares coefficients (k,) of rows `columns` (k, m) for a target (m,), the smallest where many do.

    Half of the digits are lost: enough where the answer is only a step or a score.
    """
    return solved(columns @ columns.T, columns @ target)


def solved(gram: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solution (k,) of normal equations, products of the columns (k, k) and of columns and target (k,)."""
    size = np.sqrt(np.maximum(np.diag(gram), 0.0))
    size[size == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(gram / size / size[:, None], right / size, rcond=SINGULAR)[0] / size)
