"""Least squares of many rows and few columns, from the columns' products: a hundredth of a decomposition's time."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dposv

from fieldsid.numerics.arrays import FloatArray

SINGULAR_EIGENVALUE_SHARE = 1e-12
"""Share of the largest product's eigenvalue below which a combination of columns counts as zero."""
INDEPENDENT_PIVOT = SINGULAR_EIGENVALUE_SHARE**0.25
"""Pivot of a column of length one, its part that is not of those before it, from which on no combination comes near to zero."""


def gram_least_squares(columns: FloatArray, target: FloatArray) -> FloatArray:
    """Return the least-squares coefficients (k,) of rows `columns` (k, m) for a target (m,), the smallest where many do.

    Half of the digits are lost: enough where the answer is only a step or a score.
    """
    return solve_normal_equations(columns @ columns.T, columns @ target)


def solve_normal_equations(gram: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solution (k,) of normal equations, products of the columns (k, k) and of columns and target (k,)."""
    size = np.sqrt(np.maximum(gram.diagonal(), 0.0))
    size[size == 0.0] = 1.0
    unit, wish = gram / size / size[:, None], right / size
    factor, solution, failed = dposv(unit, wish)
    if failed or not factor.diagonal().min(initial=1.0) > INDEPENDENT_PIVOT:
        solution = np.linalg.lstsq(unit, wish, rcond=SINGULAR_EIGENVALUE_SHARE)[0]
    return np.asarray(solution / size)
