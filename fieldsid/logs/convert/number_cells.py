"""Convert cells of a table to numbers, and find those that are none."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray


def as_numbers(cells: npt.NDArray[Any]) -> tuple[FloatArray, npt.NDArray[np.intp]]:
    """Return cells as float64 (n,), without a copy where they are already, and the indices of those neither number nor empty."""
    if cells.dtype.kind in "fiub":
        return cells.astype(np.float64, copy=False), np.zeros(0, dtype=np.intp)
    values = np.full(cells.size, np.nan)
    not_numbers = []
    for i, cell in enumerate(cells):
        if cell is None or cell != cell:  # noqa: PLR0124 - NaN is the one value that differs from itself
            continue
        text = str(cell)
        if "_" in text:  # float() accepts it as a separator of thousands
            not_numbers.append(i)
            continue
        try:
            values[i] = float(text.strip().replace("D", "E").replace("d", "e"))
        except ValueError:
            not_numbers.append(i)
    return values, np.asarray(not_numbers, dtype=np.intp)
