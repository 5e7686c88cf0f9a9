"""Find the clock of a table: the column of the time, how it is read, and the rate of each column."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import FieldsidError, LogError
from fieldsid.logs.channels import Source
from fieldsid.logs.convert.conditioning import in_order
from fieldsid.logs.convert.times.clock_text import DAY_S, clock_of_text
from fieldsid.logs.convert.times.time_column import YEARS_S, likely_time_unit
from fieldsid.logs.few_of import MOSTLY, NEARLY_ALL
from fieldsid.logs.mapping.canonical_names import unit_in_name, words_of
from fieldsid.logs.mapping.vocabulary import TIME, word_set
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import ReadOptions, rate_of
from fieldsid.logs.readers._clock_columns import clocks_in_parts, dates_beside, elapsed
from fieldsid.logs.readers._columns import Columns, is_counter, time_of
from fieldsid.logs.run import Note, origin_of
from fieldsid.numerics.arrays import FloatArray

OF_WEEK = tuple(map(word_set, ("tow", "itow", "gms", "week seconds", "week time")))
WEEKS = word_set("week wn wk gwk gpsweek")


@dataclass(frozen=True, slots=True)
class Clock:
    """The time (n,) in s of a table's rows, NaN where they have none, with its source in the table, and notes.

    `origin_s` is the reading of the logger's clock at time 0, where that clock counts from an epoch or from midnight.
    """

    time: FloatArray
    source: Source
    notes: tuple[Note, ...] = ()
    origin_s: float = 0.0

    @property
    def duration_s(self) -> float:
        """Return the time from the first row to the last in s."""
        seen = self.time[np.isfinite(self.time)]
        return float(seen[-1] - seen[0])

    def rate_hz(self, cells: npt.NDArray[Any]) -> float:
        """Return the rate in Hz of a column (n,): the inverse median step between its filled cells; NaN below two cells."""
        import pandas as pd

        there = ~np.asarray(pd.isna(cells)) & np.isfinite(self.time)
        return rate_of(self.time[there])


def clock_of(columns: Columns, known: Source | None) -> Clock | None:
    """Return the clock of a table: by the mapping `known`, else by the names of its columns, else by their numbers.

    None where no column increases like a time.
    """
    if known is not None and known.counts_rows:
        return Clock(time_of(columns, known, None, ReadOptions())[0], known)
    if known is not None and known.places:
        return _clock_from(columns, known)
    named = (_clock_from(columns, source) for source in _named_times(columns))
    return next((clock for clock in named if clock is not None), None) or _by_numbers(columns)


def why_no_clock(columns: Columns) -> tuple[Source, FieldsidError] | None:
    """Return the first column that has a name of a time but cannot be read as one, and the reason; None without such a column."""
    for source in _named_times(columns):
        first = columns.index(source.places[0], TIME)
        try:
            time, _ = time_of(columns, source, source.unit, ReadOptions())
            in_order(time, f"column `{columns.name(first)}`", ReadOptions())
        except FieldsidError as error:
            return source, LogError(error.what, found=error.found, hint="check that this is the time, and how it is written")
    return None


def _named_times(columns: Columns) -> Iterator[Source]:
    """Yield the sources that are a time by their names, the surest first, with the dates or weeks that belong to them.

    Besides single columns these are clocks in several columns.
    """
    meanings = [(i, meaning_of(name), set(words_of(name))) for i, name in enumerate(columns.names)]
    weeks = next((i for i, _, words in meanings if words & WEEKS), None)
    if weeks is not None:
        for i, _, words in meanings:
            if i != weeks and any(of <= words for of in OF_WEEK):
                yield Source(column=columns.place(i), unit=columns.unit(i, TIME), week=columns.place(weeks))
    surest = sorted((-meaning[1], i) for i, meaning, _ in meanings if meaning is not None and meaning[0] == TIME)
    together = list(clocks_in_parts(columns))
    parts = {columns.index(c, TIME) for source in together for c in source.columns}
    yield from (_source(columns, i) for _, i in surest if i not in parts)
    yield from together
    yield from (_source(columns, i) for _, i in surest if i in parts)
    for i, _, words in meanings if weeks is None else ():
        if any(of <= words for of in OF_WEEK):
            yield _source(columns, i)
    yield from (Source(column=columns.place(i), unit=unit) for i, unit in elapsed(columns))


def _source(columns: Columns, index: int) -> Source:
    """Return how a column of time is read: with its unit, or with the columns of its dates where it is a clock of 24 hours."""
    cells, place = columns.take(index), columns.place(index)
    if cells.dtype.kind == "O":
        clock = clock_of_text(cells)
        date = dates_beside(columns, (index,)) if clock is not None and clock.period_s == DAY_S else ()
        if date:
            return Source(column=place, date=tuple(map(columns.place, date)))
    unit = columns.unit(index, TIME) or likely_time_unit(cells)
    return Source(column=place, unit=unit)


def _clock_from(columns: Columns, source: Source) -> Clock | None:
    """Return the clock of a source; None where it cannot be read as a time, or does not increase."""
    first = columns.index(source.places[0], TIME)
    cells = columns.take(first)
    if not cells.size:
        return None
    unit = source.unit if source.columns else source.unit or unit_in_name(columns.name(first), TIME) or likely_time_unit(cells)
    try:
        time, notes = time_of(columns, source, unit, ReadOptions(salvage=True))
    except FieldsidError:  # the column is no time
        return None
    steps = np.diff(time[np.isfinite(time)])
    return Clock(time, source, origin_s=origin_of(notes)) if steps.size and bool((steps > 0.0).mean() > NEARLY_ALL) else None


def _by_numbers(columns: Columns) -> Clock | None:
    """Return the clock of the first unnamed column that increases by even steps; a number of the row only without another."""
    of_rows = None
    for clock in _even_clocks(columns):
        if not _counts_rows(columns, clock.source):
            return clock
        of_rows = of_rows or clock
    return of_rows


def _even_clocks(columns: Columns) -> Iterator[Clock]:
    """Yield the clock of each column that increases by even steps, and whose name does not mean something else."""
    for i in range(columns.width):
        cells = columns.take(i)
        name = columns.names[i] if columns.names else ""
        if meaning_of(name) is not None or cells.dtype.kind not in "iufM" or cells.size < 3:
            continue
        if is_counter(name) and cells.dtype.kind != "M":
            continue
        clock = _clock_from(columns, _source(columns, i))
        if clock is None:
            continue
        steps = np.diff(clock.time[np.isfinite(clock.time)])
        # seconds since 1970 are a time even if the steps are uneven, because the logger paused
        is_epoch = cells.dtype.kind in "iuf" and bool(((cells > YEARS_S[0]) & (cells < YEARS_S[1])).all())
        if is_epoch or float(np.std(steps)) < MOSTLY * float(np.mean(steps)):
            yield replace(clock, notes=_note_of_guess(name, clock.source.unit)) if name else clock


def _counts_rows(columns: Columns, source: Source) -> bool:
    """Whether a column increases by one from row to row, as the number of the row does."""
    cells = columns.take(columns.index(source.places[0], TIME))
    return cells.dtype.kind in "iuf" and bool((np.diff(cells) == 1).all())


def _note_of_guess(name: str, unit: str | None) -> tuple[Note, ...]:
    message = f"no column is called a time: `{name}` goes on by even steps, taken in {unit or 's'} by their size; check its unit"
    return (Note("time_guessed", message, {"column": name, "unit": unit}),)
