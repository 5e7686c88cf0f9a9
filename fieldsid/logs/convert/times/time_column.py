"""Convert time columns to seconds: numbers in any unit, epoch times, ISO 8601 text, clocks, with dates or GPS weeks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.convert.number_cells import as_numbers
from fieldsid.logs.convert.times.clock_parts import PLUS, clock_of_parts, parts_of, put_together
from fieldsid.logs.convert.times.clock_text import (
    DAY_S,
    FEW_STEPS,
    FORMS,
    HOUR_S,
    STAMP,
    WEEK_S,
    Clock,
    clock_behind_dates,
    clock_of_digits,
    clock_of_stamps,
    clock_of_text,
    lost_hours,
    made_continuous,
    round_of,
    stamps_of_text,
    without_restarts,
)
from fieldsid.logs.convert.times.coarse_stamps import rebuilt
from fieldsid.logs.convert.times.dates import YEARS, days_of_columns, texts
from fieldsid.logs.convert.units import UNITS, Unit, pick_unit, scaled
from fieldsid.logs.few_of import MOSTLY
from fieldsid.logs.reader import AS_IT_IS, ReadOptions
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import COPY_AGAIN
from fieldsid.numerics.arrays import BoolArray, FloatArray

EPOCH_FROM_S = 1e8
"""A time that starts at more than this many seconds (three years) counts from an epoch, not from the start of the run."""
GPS_EPOCH_S = datetime(1980, 1, 6, tzinfo=UTC).timestamp()
"""The day from which GPS weeks count, in seconds since 1970."""
YEARS_S = (GPS_EPOCH_S, datetime(YEARS[1], 1, 1, tzinfo=UTC).timestamp())
"""Range of the seconds since 1970 of a log; what is less counts from another start."""
LATEST_S = 1e9 * YEARS_S[1]
"""Largest plausible time, even for nanoseconds since 1970 taken for seconds: a larger number is a damaged cell."""


@dataclass(frozen=True, slots=True)
class _Column:
    """The cells (n,) of a column of times, its name, and how it is read."""

    cells: npt.NDArray[Any]
    name: str
    options: ReadOptions

    def refuse_empty(self) -> None:
        if self.cells.size == 0:
            raise LogError("the table has no rows", found=f"only the header, with column `{self.name}`", hint=COPY_AGAIN)

    def error_at(self, what: str, places: npt.NDArray[np.intp]) -> LogError:
        """Return the error for cells at some indices (k,) that are no times."""
        found = f"{places.size} of {self.cells.size}, the first in row {int(places[0]) + 1}: {str(self.cells[places[0]])[:40]!r}"
        hint = self.options.salvaging("mend the column, or leave such rows out", 1.0 - places.size / self.cells.size)
        return LogError(f"column `{self.name}` {what}", found=found, hint=hint or "check which column is the time")

    def without_time(self, there: BoolArray) -> list[Note]:
        """Return the note on rows (n,) without a time, where there are some; raises LogError unless the options say to salvage.

        `there` is the mask of the rows with a time.
        """
        missing = np.flatnonzero(~there)
        if missing.size and not self.options.salvage:
            raise self.error_at("has rows without a time", missing)
        message = f"rows left out because they have no time: {missing.size}"
        return [Note("no_time", message, {"count": int(missing.size)})] if missing.size else []


def seconds_of(
    cells: npt.NDArray[Any],
    unit: str | None,
    options: ReadOptions = AS_IT_IS,
    *,
    name: str,
    dates: Sequence[npt.NDArray[Any]] = (),
    weeks: npt.NDArray[Any] | None = None,
) -> tuple[FloatArray, list[Note]]:
    """Return a time column (n,) in s, and notes.

    Numbers are in `unit` (seconds when None). Text is ISO 8601, taken as UTC; or a date and a clock; or a clock, whose days are
    in `dates` (one column, or year, month and day) and whose form `unit` may state, see FORMS. `weeks` are the GPS weeks of a
    time of week. A time that counts from an epoch or from midnight is shifted to start at zero, and the note `time_origin` states
    its start. Stamps with too few digits are rebuilt, see coarse_stamps.py. Cells that are no times become NaN when salvaging.
    Raises LogError for a cell that is no time, MappingError for what is no unit of time.
    """
    column = _Column(cells, name, options)
    column.refuse_empty()
    if unit in FORMS or (dates and cells.dtype.kind == "O"):
        return _from_clock(_clock(column, unit if unit in FORMS else None), column, dates)
    if cells.dtype.kind == "M":
        return _of_stamps(cells.astype("datetime64[ns]"), column)
    if weeks is not None:
        return _of_weeks(column, unit, weeks)
    if cells.dtype.kind in "iuf":
        return _of_numbers(cells.astype(np.int64 if cells.dtype.kind in "iu" else np.float64), _factor(unit), column)
    return _of_text(column, unit)


def seconds_of_parts(
    columns: Sequence[npt.NDArray[Any]],
    form: str | None,
    options: ReadOptions = AS_IT_IS,
    *,
    names: Sequence[str],
    dates: Sequence[npt.NDArray[Any]] = (),
    date_names: Sequence[str] = (),
) -> tuple[FloatArray, list[Note]]:
    """Return the time (n,) in s that is the sum of several columns, and notes; `form`, such as `hh+mm+ss`, names their parts.

    Raises MappingError for a form that does not fit, LogError for a row in which a part is missing.
    """
    _Column(columns[0], names[0], options).refuse_empty()
    parts = parts_of(form, names)
    clock = clock_of_parts(columns, parts)
    time, notes = _from_clock(clock, _Column(clock.seconds, PLUS.join(names), options), dates)
    return time, [put_together(names, parts, date_names if dates else ()), *notes]


def likely_time_unit(cells: npt.NDArray[Any]) -> str | None:
    """Return the likely unit of numbers of time: by their size, which is characteristic of an epoch, else by their median step.

    None where the cells are no numbers. A median step too long for a vehicle's motion in seconds, but plausible in ms, us or ns,
    is taken for the longest of them. Fractional seconds since 1970 are seconds, however long the steps are, as in a glider's log.
    """
    if cells.dtype.kind not in "iuf" or not cells.size or not np.isfinite(cells[0]):
        return None
    size, seen = float(cells[0]), cells[np.isfinite(cells)]
    steps = np.diff(seen.astype(np.float64))
    ahead = steps[steps > 0.0]  # most steps of stamps with too few digits are zero
    step = float(np.median(ahead)) if ahead.size else 0.0
    if _are_digits_of_a_clock(seen):
        return "hhmmss"
    if any(low <= size < high for low, high in STAMPS):
        return STAMP
    if YEARS_S[0] < size < YEARS_S[1] and bool((seen != np.round(seen)).any()):
        return "s"
    of_epoch = next((u for u in ("ms", "us", "ns") if YEARS_S[0] < size * UNITS[u].factor < YEARS_S[1]), "")
    return of_epoch or ("d" if _are_days(size, step) else next(iter(units_of_step(step)), "s"))


def _are_digits_of_a_clock(seen: npt.NDArray[Any]) -> bool:
    """Whether numbers (n,) are a clock's digits, such as 142018.5: they jump at each full minute, but the clock does not."""
    if float(seen.min(initial=0.0)) < 0.0 or float(seen.max(initial=0.0)) >= 240000.0:
        return False
    if bool((seen % 100.0 >= 60.0).any() or (np.floor(seen / 100.0) % 100.0 >= 60.0).any()):
        return False
    full = np.diff(np.floor(seen / 100.0)) != 0.0
    clock, _ = made_continuous(clock_of_digits(seen.astype(np.float64)).seconds, DAY_S)
    jumps, steps = np.abs(np.diff(seen))[full], np.diff(clock)
    return bool(full.any() and (jumps >= 40.0).all() and (np.abs(steps[full]) <= FEW_STEPS * np.median(steps)).all())


STAMPS = tuple((YEARS[0] * 10.0**digits, YEARS[1] * 10.0**digits) for digits in (10, 13))
"""Ranges of dates and times written as one number, with milliseconds or without; until 2500, ms and us since 1970 are outside."""


def _are_days(size: float, step: float) -> bool:
    """Whether a time counts days of a calendar: its size is that of a present date, and its step is plausible only in days."""
    return any(low < size < high for low, high in DAYS) and 0.0 < step < FASTEST_S


DAYS = ((2e4, 8e4), (7e5, 8e5), (2.4e6, 2.5e6))
"""Ranges of days: since 1900 as in spreadsheets (1954 to 2119; as in astronomy from 1982), since year 0, and Julian days."""
FASTEST_S = 1e-4
"""A shorter step is implausible in seconds; in days it is a step of less than 9 s."""
SLOW_S = 5.0
"""A log with a longer step would not show a vehicle's motion, so that its time must be in another unit."""


def units_of_step(step: float) -> tuple[str, ...]:
    """Return the units of time in which a step is plausible between two samples of a vehicle's motion, the longest first."""
    return tuple(unit for unit in ("s", "ms", "us", "ns") if FASTEST_S <= step * UNITS[unit].factor <= SLOW_S)


def time_unit(unit: str, what: str = "time") -> Unit:
    """Return a unit of time; raises MappingError for another, which lists the units and the forms of a clock."""
    return pick_unit(unit, ("time",), what, f", {', '.join(FORMS)}")


def _factor(unit: str | None) -> float:
    return 1.0 if unit is None else time_unit(unit).factor


def _of_numbers(values: npt.NDArray[Any], factor: float, column: _Column) -> tuple[FloatArray, list[Note]]:
    """Return times (n,) in units of `factor` s in s, and notes.

    The first of integers is subtracted before they become floats, so that ns of an epoch keep every digit; floats remain as they
    are, because their digits show how they were rounded.
    """
    there = np.abs(values.astype(np.float64)) * factor <= LATEST_S
    notes = column.without_time(there)
    again = round_of(values[there], factor)
    base = 0 if again is not None or values.dtype.kind == "f" else int(values[0])
    numbers = (values - base if base else values).astype(np.float64)
    numbers = numbers if there.all() else np.where(there, numbers, np.nan)
    if again is not None:
        numbers, note = without_restarts(numbers, again, column.name)
        notes.append(note)
    numbers, coarse = rebuilt(numbers, column.name)
    seen = numbers[np.isfinite(numbers)]
    first = float(seen[0]) if seen.size else 0.0
    if (base + first) * factor <= EPOCH_FROM_S:
        return scaled(numbers + base if base else numbers, factor), [*notes, *coarse]
    return scaled(numbers - first, factor), [*notes, *coarse, origin_note((base + first) * factor)]


def _of_text(column: _Column, unit: str | None) -> tuple[FloatArray, list[Note]]:
    cells = column.cells
    values, wrong = as_numbers(cells)
    if not wrong.size or wrong.size < cells.size // 2:
        if wrong.size and not column.options.salvage:
            raise column.error_at("holds cells that are no times", wrong)
        return _of_numbers(values, _factor(unit), column)
    stamps = _iso(cells)
    if np.isnat(stamps).mean() > MOSTLY:
        other = stamps_of_text(cells)
        if other is not None:
            return _from_start(other, column)
        clock = clock_of_text(cells) or clock_behind_dates(cells)
        if clock is not None:
            return _from_clock(clock, column, ())
    if np.isnat(stamps).all() and wrong.size < cells.size:
        raise column.error_at("holds cells that are no times", wrong)
    return _of_stamps(stamps, column)


def _of_stamps(stamps: npt.NDArray[np.datetime64], column: _Column) -> tuple[FloatArray, list[Note]]:
    """Return the seconds of dates and times (n,) from the first one on, and notes; NaT where a row has none."""
    there, nanoseconds = ~np.isnat(stamps), stamps.astype(np.int64)
    start = int(nanoseconds[there][0]) if there.any() else 0
    return _from_start(np.where(there, (nanoseconds - start) / 1e9, np.nan), column, start_s=start / 1e9)


def _from_clock(clock: Clock, column: _Column, dates: Sequence[npt.NDArray[Any]]) -> tuple[FloatArray, list[Note]]:
    """Return the time of a clock, continuous over midnights and full hours, and notes.

    The days are taken from `dates` where the clock has a period of one day.
    """
    days = days_of_columns(dates) if dates and clock.period_s == DAY_S else None
    if days is not None:
        return _from_start(clock.seconds + DAY_S * days, column)
    seconds, rounds = made_continuous(clock.seconds, clock.period_s)
    time, notes = _from_start(seconds, column, is_of_day=np.isfinite(clock.period_s))
    return time, [*notes, lost_hours(column.name, rounds, clock.period_s)] if clock.period_s <= HOUR_S else notes


def _clock(column: _Column, form: str | None) -> Clock:
    if form == "hhmmss":
        return clock_of_digits(as_numbers(column.cells)[0])
    found = clock_of_stamps(column.cells) if form == STAMP else clock_of_text(column.cells, form)
    if found is None:
        raise column.error_at("holds cells that are no clock", np.arange(column.cells.size))
    return found


def _from_start(
    seconds: FloatArray, column: _Column, *, start_s: float = 0.0, is_of_day: bool = False
) -> tuple[FloatArray, list[Note]]:
    """Return seconds (n,) after `start_s` counted from the first one, and notes on cells without a time and on the start."""
    there = np.isfinite(seconds)
    notes = column.without_time(there)
    start = float(seconds[there][0]) if there.any() else 0.0
    # A clock has at most nine decimals of a second; further digits are rounding errors of the subtraction.
    time, coarse = rebuilt(np.round(seconds - start, 9), column.name)
    return time, [*notes, *coarse, origin_note(start_s + start, is_of_day=is_of_day)]


def _of_weeks(column: _Column, unit: str | None, weeks: npt.NDArray[Any]) -> tuple[FloatArray, list[Note]]:
    """Return the time of GPS weeks and times of week, and notes; without `unit` the size decides between s and ms."""
    values, _ = as_numbers(column.cells)
    largest = float(np.nanmax(values, initial=0.0))
    factor = _factor(unit or ("s" if largest <= WEEK_S else "ms"))
    week_start = WEEK_S * as_numbers(weeks)[0] + GPS_EPOCH_S
    return _from_start(scaled(values, factor) + week_start, column)


def _iso(cells: npt.NDArray[Any]) -> npt.NDArray[np.datetime64]:
    import pandas as pd

    parsed = pd.to_datetime(texts(cells), format="ISO8601", utc=True, errors="coerce")
    return np.asarray(parsed.dt.tz_localize(None).to_numpy(dtype="datetime64[ns]"))


def origin_note(start_s: float, *, is_of_day: bool = False) -> Note:
    """Return the note that states the reading of the log's clock in s at time 0 of the run."""
    where = f"{start_s:.3f} s of the log's clock, which has no date" if is_of_day else f"{start_s:.6f} s of the log's clock"
    return Note("time_origin", f"time 0 is {where}", {"origin_ns": round(start_s * 1e9)})
