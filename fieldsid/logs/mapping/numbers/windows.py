"""Changes of a table's columns over windows of some samples."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray

FEWEST = 50
"""Windows from which on columns are compared."""
Number = TypeVar("Number", np.float64, np.complex128)


def width_of(time: FloatArray, window_s: float) -> int:
    """Return the samples of a window at times (n,)."""
    step = float(np.nanmedian(np.diff(time))) if time.size > 1 else 0.0
    return max(1, round(window_s / step)) if step > 0.0 else 1


def change(values: npt.NDArray[Number], width: int) -> npt.NDArray[Number]:
    """Return the change of a column (n,) over a window about each sample, NaN at the ends."""
    found = np.full_like(values, np.nan)
    if values.size > width:
        found[width // 2 :][: values.size - width] = values[width:] - values[:-width]
    return found
