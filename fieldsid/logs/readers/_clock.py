"""The clock of a table that is listed, and how often each of its columns has a number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.channels import Source
from fieldsid.logs.clocktime import likely_time_unit, seconds_of
from fieldsid.logs.names import TIME, unit_in_name
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers._columns import Columns
from fieldsid.logs.run import FloatArray
from fieldsid.logs.words import meaning_of

MOSTLY = 0.9
"""Share of the steps of a column that go on, from which it is taken for time: a damaged log may go back here and there."""


@dataclass(frozen=True, slots=True)
class Clock:
    """The time of a table's rows (n,) in s, NaN where they have none, and its length."""

    time: FloatArray

    @property
    def duration_s(self) -> float:
        """From the first time to the last, in s."""
        seen = self.time[np.isfinite(self.time)]
        return float(seen[-1] - seen[0])

    def rate_hz(self, cells: npt.NDArray[Any]) -> float:
        """Return how often a column (n,) has a cell, by the median of the steps between them; NaN below two."""
        import pandas as pd

        there = ~np.asarray(pd.isna(cells)) & np.isfinite(self.time)
        steps = np.diff(self.time[there])
        return 1.0 / float(np.median(steps)) if steps.size else float("nan")


def clock_of(columns: Columns, known: Source | None) -> Clock | None:
    """Return the clock of a table, by its mapping or by the names of its columns; None where no column goes on like time."""
    if known is not None and known.column is not None:
        index, unit = columns.index(known.column, TIME), known.unit
    else:
        guesses = [
            (-meaning[1], i) for i, name in enumerate(columns.names) if (meaning := meaning_of(name)) and meaning[0] == TIME
        ]
        if columns.names and not guesses:
            return None
        index, unit = (min(guesses)[1] if guesses else 0), None
    cells, name = columns.take(index), columns.name(index)
    if not cells.size:
        return None
    unit = unit or unit_in_name(name, TIME) or likely_time_unit(cells)
    time, _ = seconds_of(cells, unit, ReadOptions(salvage=True), name=name)
    steps = np.diff(time[np.isfinite(time)])
    return Clock(time) if steps.size and bool((steps > 0.0).mean() > MOSTLY) else None
