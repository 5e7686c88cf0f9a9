"""A column that grows block by block, without its blocks and the whole in memory at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

NUMBERS = "fiub"
ROOM = 1.01
"""By how much a column is made longer than it is expected to become: one that is too short is moved once more."""


class GrowingColumn:
    """Cells (n,) of a column: numbers as long as all blocks hold nothing else, words from then on."""

    def __init__(self) -> None:
        self._cells: npt.NDArray[Any] = np.zeros(0)
        self._count = 0

    def add(self, block: npt.NDArray[Any], expected: float) -> None:
        """Append a block; `expected` is the number of cells that the column will probably have."""
        if not self._count:
            self._cells = self._cells.astype(block.dtype)
        elif block.dtype != self._cells.dtype:
            has_words = any(dtype.kind not in NUMBERS for dtype in (block.dtype, self._cells.dtype))
            self._cells = self._cells.astype(object if has_words else np.result_type(block, self._cells))
        end = self._count + block.size
        if end > self._cells.size:
            self._cells.resize(max(end, round(ROOM * expected)), refcheck=False)
        self._cells[self._count : end] = block
        self._count = end

    def whole(self) -> npt.NDArray[Any]:
        """Return the cells (n,), read-only; the column grows no more."""
        self._cells.resize(self._count, refcheck=False)
        self._cells.setflags(write=False)
        return self._cells
