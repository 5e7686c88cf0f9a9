"""Where what holds of samples holds of several in a row."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import BoolArray


def blocks_of(mask: BoolArray) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return where the blocks of a mask (n,) begin, and where the samples behind them are."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges[::2], edges[1::2]
