"""The clock of a table that is listed: which column is the time, how it is read, and how often each column has a number."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import FieldsidError
from fieldsid.logs.channels import Source
from fieldsid.logs.convert.clock_text import DAY_S, clock_of_text, days_of
from fieldsid.logs.convert.time_column import likely_time_unit, seconds_of
from fieldsid.logs.mapping.canonical_names import TIME, unit_in_name
from fieldsid.logs.mapping.word_meaning import meaning_of, words_of
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers._columns import Columns, is_counter
from fieldsid.numerics.arrays import FloatArray

MOSTLY = 0.9
"""Share of the steps of a column that go on, from which it is taken for time: a damaged log may go back here and there."""
REGULAR = 0.5
"""Standard deviation of the steps over their mean, up to which a column that nobody named goes on like time."""
OF_WEEK = (
    frozenset({"tow"}),
    frozenset({"itow"}),
    frozenset({"gms"}),
    frozenset({"week", "seconds"}),
    frozenset({"week", "time"}),
)
WEEKS = frozenset({"week", "wn", "wk", "gwk", "gpsweek"})
DATES = frozenset({"date", "day", "datum"})


@dataclass(frozen=True, slots=True)
class Clock:
    """The time of a table's rows (n,) in s, NaN where they have none, and the column it is from, with what reads it."""

    time: FloatArray
    source: Source

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
        return _tried(columns, known)
    named = (_tried(columns, source) for source in _named(columns))
    return next((clock for clock in named if clock is not None), None) or _by_numbers(columns)


def _named(columns: Columns) -> Iterator[Source]:
    """Yield the columns that are called a time, the surest first, with the dates or weeks beside them."""
    meanings = [(i, meaning_of(name), set(words_of(name))) for i, name in enumerate(columns.names)]
    weeks = next((i for i, _, words in meanings if words & WEEKS), None)
    if weeks is not None:
        for i, _, words in meanings:
            if i != weeks and any(of <= words for of in OF_WEEK):
                yield Source(column=_place(columns, i), unit=columns.unit(i, TIME), week=_place(columns, weeks))
    dates = next((i for i, _, words in meanings if words & DATES and not words & {"time"}), None)
    for i in sorted((i for i, meaning, _ in meanings if meaning and meaning[0] == TIME), key=lambda i: -meanings[i][1][1]):  # type: ignore[index]
        yield _source(columns, i, dates)
    for i, _, words in meanings if weeks is None else ():
        if any(of <= words for of in OF_WEEK):
            yield _source(columns, i, None)


def _source(columns: Columns, index: int, dates: int | None) -> Source:
    """Return how a column of time is read: its unit, or the column of its days where it is a clock that counts all of one."""
    cells, place = columns.take(index), _place(columns, index)
    if cells.dtype.kind == "O" and dates is not None:
        clock = clock_of_text(cells)
        if clock is not None and clock.period_s == DAY_S and days_of(columns.take(dates)) is not None:
            return Source(column=place, date=_place(columns, dates))
    unit = columns.unit(index, TIME) or _unit_by_size(cells)
    return Source(column=place, unit=unit)


def _unit_by_size(cells: npt.NDArray[Any]) -> str | None:
    if cells.dtype.kind not in "iuf" or not cells.size:
        return None
    steps = np.diff(cells[np.isfinite(cells)].astype(np.float64))
    return likely_time_unit(cells, float(np.median(steps)) if steps.size else 0.0)


def _place(columns: Columns, index: int) -> str | int:
    """Return the name of a column, or its place where it has none of its own."""
    name = columns.name(index)
    return name if columns.names.count(name) == 1 else index


def _tried(columns: Columns, source: Source) -> Clock | None:
    index = columns.index(source.column if source.column is not None else 0, TIME)
    cells = columns.take(index)
    beside = [None if c is None else columns.take(columns.index(c, TIME)) for c in (source.date, source.week)]
    if not cells.size:
        return None
    unit = source.unit or unit_in_name(columns.name(index), TIME) or _unit_by_size(cells)
    try:
        time, _ = seconds_of(cells, unit, ReadOptions(salvage=True), name=columns.name(index), dates=beside[0], weeks=beside[1])
    except FieldsidError:  # what is no time is not taken for one
        return None
    time = time if source.scale is None else time * source.scale
    steps = np.diff(time[np.isfinite(time)])
    return Clock(time, source) if steps.size and bool((steps > 0.0).mean() > MOSTLY) else None


def _by_numbers(columns: Columns) -> Clock | None:
    """Return the first column that goes on by even steps, and is not named as something else."""
    for i in range(columns.width):
        cells = columns.take(i)
        name = columns.names[i] if columns.names else ""
        if meaning_of(name) is not None or is_counter(name) or cells.dtype.kind not in "iuf" or cells.size < 3:
            continue
        clock = _tried(columns, Source(column=_place(columns, i), unit=_unit_by_size(cells)))
        if clock is None:
            continue
        steps = np.diff(clock.time[np.isfinite(clock.time)])
        if float(np.std(steps)) < REGULAR * float(np.mean(steps)):
            return clock
    return None
