"""Recursive instrumental variables with forgetting, in the information form: the sums of products after every row.

    M <- beta M + z [phi, q]',   N <- beta^2 N + z z',   Theta = (M of phi)^-1 (M of q)
Theta is that of the update by P = (M of phi)^-1 and its gain, without a start value of P. Under a white residual of variance s^2
its covariance is s^2 P N P'. Source: the paper, estimator 2 (recursive); Ljung 1999, section 11.4.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def accumulate(
    instruments: FloatArray, rows: FloatArray, beta: float, keep: npt.NDArray[np.int64], products: FloatArray, squares: FloatArray
) -> None:
    """Fill M (k, p, p + 1) and N (k, p, p) after the rows `keep` (k,) of instruments (n, p) and [phi, q] (n, p + 1)."""
    size, at = instruments.shape[1], 0
    m, n = np.zeros((size, size + 1)), np.zeros((size, size))
    for i in range(rows.shape[0]):
        for j in range(size):
            z = instruments[i, j]
            for k in range(size):
                m[j, k] = beta * m[j, k] + z * rows[i, k]
                n[j, k] = beta * beta * n[j, k] + z * instruments[i, k]
            m[j, size] = beta * m[j, size] + z * rows[i, size]
        if at < keep.shape[0] and i == keep[at]:
            products[at], squares[at] = m, n
            at += 1


def recursive_iv(
    instruments: FloatArray, rows: FloatArray, beta: float, keep: npt.NDArray[np.int64]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Theta (k, p), its standard errors under a white residual of variance one (k, p), and the last P (p, p).

    They are those after the rows `keep`, NaN until the rows determine Theta for good.
    """
    size = instruments.shape[1]
    products, squares = np.empty((keep.size, size, size + 1)), np.empty((keep.size, size, size))
    accumulate(instruments, rows, beta, keep, products, squares)
    inverse = _inverse(products[:, :, :size], squares)
    theta = np.einsum("kij,kj->ki", inverse, products[:, :, size])
    variance = np.einsum("kij,kjl,kil->ki", inverse, squares, inverse)
    return theta, np.sqrt(np.maximum(variance, 0.0)), inverse[-1]


def _inverse(normal: FloatArray, squares: FloatArray) -> FloatArray:
    """Return the inverses of (k, p, p), NaN up to the last that is singular to rounding."""
    size, scale = normal.shape[1], np.sqrt(np.einsum("kii->ki", squares))
    outer = scale[:, :, None] * scale[:, None, :]
    scaled = normal / np.where(outer > 0.0, outer, 1.0)
    lost = np.linalg.det(scaled) == 0.0
    scaled[lost] = np.eye(size)
    inverse = np.linalg.inv(scaled)
    lost |= np.abs(inverse).max(axis=(1, 2)) * np.finfo(float).eps * size > 1.0
    known = int(np.flatnonzero(lost)[-1]) + 1 if lost.any() else 0
    inverse[:known] = np.nan
    inverse[known:] /= outer[known:]
    return np.asarray(inverse, dtype=np.float64)
