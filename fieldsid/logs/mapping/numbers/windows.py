"""Changes of a table's columns over windows about each sample."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.logs.doctor.together import Number, over


def change(values: npt.NDArray[Number], width: int) -> npt.NDArray[Number]:
    """Return the change of a column (n,) over a window about each sample, NaN at the ends."""
    found = np.full_like(values, np.nan)
    if values.size > width:
        found[width // 2 :][: values.size - width] = over(values, width)
    return found
