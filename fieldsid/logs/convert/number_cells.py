"""Cells of a table as numbers, and which of them are none."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray


def as_numbers(cells: npt.NDArray[Any]) -> tuple[FloatArray, npt.NDArray[np.intp]]:
    """Return cells as float64 (n,), themselves where they are, and the places of those that are neither numbers nor empty."""
    if cells.dtype.kind in "fiub":
        return cells.astype(np.float64, copy=False), np.zeros(0, dtype=np.intp)
    values = np.full(cells.size, np.nan)
    wrong = []
    for i, cell in enumerate(cells):
        if cell is None or cell != cell:  # noqa: PLR0124 - NaN is the one value that differs from itself
            continue
        text = str(cell)
        if "_" in text:  # which Python takes for a mark between thousands
            wrong.append(i)
            continue
        try:
            values[i] = float(text.strip().replace("D", "E").replace("d", "e"))
        except ValueError:
            wrong.append(i)
    return values, np.asarray(wrong, dtype=np.intp)
