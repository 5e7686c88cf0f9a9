"""Read times written as on a clock: `hh:mm:ss.s`, or `mm:ss.s` that starts again each hour, with or without dates.

A clock that starts again is made continuous: where it falls back by more than half of its period (a day, or an hour where a
spreadsheet has dropped the hours), the next period has begun. The same is done for numbers of time that start again with each
minute, hour, day or week, or at the overflow of a counter of 16 or 32 bits. There the step across the restart must be like the
other steps of the log. This distinguishes a restart from a clock that was set back, and from two logs in one file, of which the
second may start at any time.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.number_cells import as_numbers
from fieldsid.logs.convert.times.dates import DATE, days_of, stamps_in, texts
from fieldsid.logs.convert.units import UNITS
from fieldsid.logs.few_of import MOSTLY
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

MINUTE_S, HOUR_S, DAY_S = (UNITS[unit].factor for unit in ("min", "h", "d"))
WEEK_S = 7.0 * DAY_S
STAMP = "yyyymmddhhmmss"
FORMS = {"hh:mm:ss": DAY_S, "mm:ss": HOUR_S, "hh:mm": DAY_S, "hhmmss": DAY_S, STAMP: np.inf}
"""Forms of a clock that a mapping may state as the unit of time, each with the period in s after which it starts again."""
CLOCK = re.compile(
    r"(?:(\d+) days? )?(?:(\d{1,3}):)?(\d{1,3}):(\d{1,2}(?:[.,]\d*|:\d{3})?)"
    r"\s*(?:([AaPp])\.?[Mm]\.?)?\s*(?:Z|[A-Z]{3,4})?"
)
"""Elapsed days, hours, minutes, seconds, am or pm, and a time zone, which is ignored because all cells have the same."""
IN_WORDS = (
    "%a %b %d %H:%M:%S %Y", "%b %d, %Y %I:%M:%S.%f %p", "%b %d, %Y %I:%M:%S %p", "%b %d, %Y %H:%M:%S.%f", "%b %d, %Y %H:%M:%S",
    "%a, %d %b %Y %H:%M:%S",
)  # fmt: skip
"""Dates in words as the C library, spreadsheets and mail write them."""


@dataclass(frozen=True, slots=True)
class Clock:
    """The readings (n,) of a clock in s, NaN where a cell is none, and the period in s after which it starts again."""

    seconds: FloatArray
    period_s: float


def clock_of_text(cells: npt.NDArray[Any], form: str | None = None) -> Clock | None:
    """Return the clock of a column of readings; None unless more than half of the cells are readings."""
    parts = texts(cells).str.extract(f"^{CLOCK.pattern}$")
    numbers = (parts[i].str.replace(r"[,:]", ".", regex=True) for i in range(4))
    day, first, second, third = (n.astype("float64").to_numpy(na_value=np.nan) for n in numbers)
    if np.isfinite(third).mean() <= MOSTLY:
        return None
    half_day = parts[4].str.lower().map({"a": 0.0, "p": 12.0}).to_numpy(dtype=np.float64)
    has_hours = bool(np.isfinite(first).any())
    if form == "hh:mm" or (not has_hours and np.isfinite(half_day).any()):
        first, second, third = second, third, np.zeros_like(third)
    elif not has_hours:
        return Clock(60.0 * second + third, HOUR_S)
    hours = np.where(np.isfinite(half_day), first % 12.0 + np.nan_to_num(half_day), first)
    counts_days = bool(np.isfinite(day).any())
    return Clock(DAY_S * np.nan_to_num(day) + HOUR_S * hours + 60.0 * second + third, np.inf if counts_days else DAY_S)


def clock_of_digits(numbers: FloatArray) -> Clock:
    """Return the clock of readings written as one number: 142018.5 is 14:20:18.5."""
    hours, minutes = np.floor(numbers / 1e4), np.floor(numbers / 1e2) % 100.0
    return Clock(HOUR_S * hours + 60.0 * minutes + numbers % 100.0, DAY_S)


def clock_of_stamps(cells: npt.NDArray[Any]) -> Clock | None:
    """Return the clock of dates and times as one number, as 20240301142018.5, or 20240301142018500 with milliseconds.

    None where less than half of the cells are dates.
    """
    numbers = cells if cells.dtype.kind in "iu" else as_numbers(cells)[0]
    worth = 1000 if float(np.nanmax(numbers)) > 1e15 else 1
    days = days_of(np.floor(numbers / 1e6) if worth == 1 else np.floor(numbers // worth / 1e6))
    if days is None:
        return None
    clock = clock_of_digits((numbers // worth % 1000000).astype(np.float64) if worth > 1 else np.asarray(numbers % 1e6))
    return Clock(DAY_S * days + clock.seconds + (numbers % worth / worth if worth > 1 else 0.0), np.inf)


def made_continuous(seconds: FloatArray, period_s: float) -> tuple[FloatArray, int]:
    """Return the readings (n,) of a clock made continuous over its restarts each `period_s`, and the number of restarts."""
    seen = np.isfinite(seconds)
    steps = np.diff(seconds[seen], prepend=seconds[seen][:1])
    rounds = np.cumsum(steps < -0.5 * period_s)
    if not rounds.size or not rounds[-1]:
        return seconds, 0
    continuous = seconds.copy()
    continuous[seen] += period_s * rounds
    return continuous, int(rounds[-1])


def stamps_of_text(cells: npt.NDArray[Any]) -> FloatArray | None:
    """Return the seconds (n,) since 1970 of cells with a date and a clock; None where less than half of the cells are such."""
    halves = _halves(cells)
    days = days_of(halves[0]) if halves is not None else None
    clock = _of_a_day(halves[1]) if halves is not None and days is not None else None
    return DAY_S * days + clock.seconds if days is not None and clock is not None else _in_words(cells)


def clock_behind_dates(cells: npt.NDArray[Any]) -> Clock | None:
    """Return the clock (n,) after impossible dates such as 31 November, which a logger writes whose date was never set."""
    halves = _halves(cells)
    is_dated = halves is not None and texts(halves[0]).str.fullmatch(DATE.pattern).mean() > MOSTLY
    return _of_a_day(halves[1]) if halves is not None and is_dated else None


def _halves(cells: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]] | None:
    """Return the parts (n,) of cells before and after the first blank or T between digits; None where there is none."""
    parts = texts(cells).str.split(r"(?<=\d)[ T_]+(?=\d)", n=1, regex=True, expand=True)
    return None if parts.shape[1] != 2 else (parts[0].to_numpy(dtype=object), parts[1].to_numpy(dtype=object))


def _of_a_day(cells: npt.NDArray[Any]) -> Clock | None:
    """Return the clock after a date: hours and minutes with or without seconds, or digits alone; None where it is none."""
    clock = clock_of_text(cells)
    if clock is not None:
        return clock if clock.period_s != HOUR_S else clock_of_text(cells, "hh:mm")
    digits, wrong = as_numbers(cells)
    return clock_of_digits(digits) if wrong.size < MOSTLY * cells.size else None


def _in_words(cells: npt.NDArray[Any]) -> FloatArray | None:
    """Return the seconds (n,) since 1970 of dates in the forms of IN_WORDS; None where less than half of the cells are such."""
    stamps = stamps_in(texts(cells), IN_WORDS)
    return None if stamps is None else np.where(np.isnat(stamps), np.nan, stamps.astype(np.int64) / 1e6)


def lost_hours(name: str, times: int, period_s: float) -> Note:
    """Return the note that a clock has no hours, or no minutes, and how often the next one was assumed to begin."""
    counts, lacks = ("minutes and seconds", "hour") if period_s == HOUR_S else ("seconds", "minute")
    again = f"; it starts again {times} time{'s' * (times != 1)}, each taken for the next {lacks}" if times else ""
    return Note("lost_hours", f"`{name}` counts {counts}, the {lacks} is not in it{again}", {"count": times})


FEW_STEPS = 5.0
"""Multiple of the median step of a log or of a signal up to which a step is no gap, however long it is in s."""
ROUNDS_S = {"minute": MINUTE_S, "hour": HOUR_S, "day": DAY_S, "week": WEEK_S}
COUNTERS = {"16 bits": 2.0**16, "32 bits": 2.0**32}
"""Numbers after which a counter overflows, whatever its unit."""


Round = tuple[str, float]
"""The period after which a time starts again: in words, and in the unit of the numbers."""


def round_of(values: npt.NDArray[Any], factor: float) -> Round | None:
    """Return the shortest period after which numbers (n,) of time start again, in units of `factor` s; None where they do not.

    At more than half of the restarts, the step into the next period must be like the other steps of the log.
    """
    steps = np.diff(values.astype(np.float64))
    ahead = steps[steps > 0.0]
    if not ahead.size or not bool((steps < 0.0).any()):
        return None
    usual, span = float(np.median(ahead)), float(np.ptp(values.astype(np.float64)))
    rounds = [(f"each {name}", s / factor) for name, s in ROUNDS_S.items()]
    for words, period in [*rounds, *((f"after {bits}", size) for bits, size in COUNTERS.items())]:
        falls = steps[steps < -0.5 * period] + period
        if span <= period and falls.size and float((falls <= FEW_STEPS * usual).mean()) > MOSTLY:
            return words, period
    return None


def without_restarts(values: FloatArray, found: Round, name: str) -> tuple[FloatArray, Note]:
    """Return numbers (n,) of time made continuous over their restarts, and the note that says how often they started again."""
    words, period = found
    continuous, times = made_continuous(values, period)
    message = f"`{name}` starts again {words}, {times} time{'s' * (times != 1)}: taken for one time that goes on"
    return continuous, Note("starts_again", message, {"count": times, "period": period})
