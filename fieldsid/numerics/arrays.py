"""Types of arrays, as every file annotates them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.intp]
ComplexArray = npt.NDArray[np.complex128]


ROUNDING_SHARE = 1e-9
"""Relative precision of sums of many numbers, and of numbers that were written and read: less is a rounding error."""


def known(value: float | None) -> float:
    """Return a number read from a file, NaN for None, as which NaN is written."""
    return float("nan") if value is None else float(value)
