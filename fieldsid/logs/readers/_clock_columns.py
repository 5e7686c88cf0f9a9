"""Which columns of a table are the parts of one clock: `hours`, `minutes` and `seconds`, `H`, `M` and `S`, year to second.

A name only proposes a part. It is one where its numbers are: whole ones below the seconds or minutes that fall back where they
go on. Of several columns with the name of a part that beside the others is taken.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from fieldsid.logs.channels import Source
from fieldsid.logs.convert.number_cells import as_numbers
from fieldsid.logs.convert.times.clock_parts import PARTS, PLUS, carries, seconds_of_part
from fieldsid.logs.convert.times.clock_text import DAY_S, MINUTE_S, clock_of_text
from fieldsid.logs.convert.times.dates import days_of_columns
from fieldsid.logs.mapping.canonical_names import words_of
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.readers._columns import Columns
from fieldsid.numerics.arrays import FloatArray

CALLED: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "year": frozenset({"year", "years", "yr", "yyyy", "yy", "y", "jahr"}),
        "month": frozenset({"month", "months", "mon", "mo", "mm", "m", "monat"}),
        "day": frozenset({"day", "days", "dd", "dy", "d", "tag"}),
        "yearday": frozenset({"doy", "yday", "jday", "yearday", "jd", "ddd"}),
        "hh": frozenset({"hour", "hours", "hr", "hrs", "hh", "h", "stunde", "stunden"}),
        "mm": frozenset({"minute", "minutes", "min", "mins", "mn", "mi", "mm", "m", "minuten"}),
        "ss": frozenset({"second", "seconds", "sec", "secs", "ss", "s", "sekunde", "sekunden"}),
        "ds": frozenset({"decisecond", "deciseconds", "tenth", "tenths"}),
        "cs": frozenset({"centisecond", "centiseconds", "centi", "hundredth", "hundredths", "hsec", "csec"}),
        "ms": frozenset({"millisecond", "milliseconds", "millisec", "millis", "milli", "msec", "msecs", "ms"}),
        "us": frozenset({"microsecond", "microseconds", "microsec", "micros", "micro", "usec", "usecs", "us"}),
        "ns": frozenset({"nanosecond", "nanoseconds", "nanosec", "nanosecs", "nanos", "nano", "nsec", "nsecs", "ns"}),
        "hhmm": frozenset({"hhmm"}),
        "hhmmss": frozenset({"hhmmss"}),
    }
)
"""What the parts of a date and a clock are called; a month and a minute may share a name."""
BESIDE = frozenset({
    "time", "timestamp", "stamp", "header", "clock", "utc", "gps", "gnss", "gmt", "rtc", "local", "log", "pc", "unix", "unixtime",
    "epoch", "posix",
})  # fmt: skip
"""Words that may stand beside the name of a part."""
DATES = frozenset({"date", "datum", "day", "yyyymmdd", "ddmmyy", "ddmmyyyy", "yymmdd"})
"""Words of a column of dates."""
FRACTIONS = ("ms", "us", "ns", "cs", "ds")
"""Parts that may follow whole seconds."""
UPPERS = ("hhmm", "mm", "hh")
"""Parts that may count the rounds of those below."""
UNITS_CALLED = {"ss": "s", "ms": "ms", "us": "us", "ns": "ns", "mm": "min", "hh": "h", "yearday": "d"}
"""The unit of a column that is called as a part of a clock is, and goes on."""
_BEHIND = re.compile(r"[\[(].*|[ _]of[ _].*", re.IGNORECASE)
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")

Chain = list[tuple[str, int]]
"""Parts of a clock and their columns, the one that counts longest first."""


def clocks_in_parts(columns: Columns) -> Iterator[Source]:
    """Yield the clocks that several columns of a table make up, with the columns of their days."""
    called = _called(columns)
    for start in _starts(columns, called):
        chain = _upwards(columns, called, _downwards(columns, called, start))
        places = tuple(index for _, index in chain)
        date = dates_beside(columns, places) if max(PARTS[part].period_s for part, _ in chain) == DAY_S else ()
        if len(chain) > 1 or len(date) > 1:
            unit = PLUS.join(part for part, _ in chain)
            yield Source(columns=tuple(map(columns.place, places)), unit=unit, date=tuple(map(columns.place, date)))


def elapsed(columns: Columns) -> Iterator[tuple[int, str]]:
    """Yield the columns that are called by a unit of time, as `minutes`, with that unit."""
    called = _called(columns)
    for part, unit in UNITS_CALLED.items():
        yield from ((i, unit) for i in called[part] if len(columns.name(i)) > 1)


def dates_beside(columns: Columns, clock: tuple[int, ...]) -> tuple[int, ...]:
    """Return the column of the dates beside a clock's, or those of year, month and day or of year and day of the year.

    Nothing where there is none.
    """
    dated = [(i,) for i, name in enumerate(columns.names) if DATES & set(words := words_of(name)) and "time" not in words]
    free = {part: [i for i in places if i not in clock] for part, places in _called(columns).items()}
    parts: list[tuple[int, ...]] = []
    for year in _nearest(free["year"], clock[0]):
        days = _nearest(free["day"], year)
        parts += [(year, month, day) for month in _nearest(free["month"], year) for day in days if day != month]
        parts += [(year, day) for day in _nearest(free["yearday"], year)]
    return next((c for c in (*dated, *parts) if days_of_columns([columns.take(i) for i in c]) is not None), ())


def _called(columns: Columns) -> dict[str, list[int]]:
    """Return the columns whose name is that of a part, by part."""
    found: dict[str, list[int]] = {part: [] for part in CALLED}
    for i, name in enumerate(columns.names):
        words = {w.lower() for w in _WORD.findall(_BEHIND.sub("", name))} - BESIDE
        for part, called in CALLED.items():
            if words and (words <= called or (words - called == {"second"} and part in FRACTIONS)):
                found[part].append(i)
    return found


def _starts(columns: Columns, called: Mapping[str, list[int]]) -> Iterator[tuple[str, int]]:
    """Yield the columns from which a clock may be put together: its seconds, else its minutes or hours with a fraction."""
    for i in called["ss"]:
        seen = _numbers(columns, i)
        if seen.size:
            yield ("ss" if float(seen.max()) <= MINUTE_S else "s"), i
    for i in called["hhmmss"]:
        yield "hhmmss", i
    for i, name in enumerate(columns.names) if called["ms"] or called["us"] else ():
        meaning = meaning_of(name)
        if meaning is not None and meaning[0] == TIME and columns.take(i).dtype.kind == "O":
            clock = clock_of_text(columns.take(i))
            if clock is not None and clock.period_s == DAY_S:
                yield "hh:mm:ss", i
    for part in ("mm", "hh"):
        for i in called[part]:
            if bool((_numbers(columns, i) % 1.0 != 0.0).any()):
                yield part, i


def _downwards(columns: Columns, called: Mapping[str, list[int]], start: tuple[str, int]) -> Chain:
    """Return whole seconds with the column of their fraction, or what it starts from alone."""
    part, index = start
    seconds = _seconds(columns, part, index)
    seen = seconds[np.isfinite(seconds)]
    if bool((seen != np.round(seen)).any()):
        return [start]
    for lower in FRACTIONS:
        for i in _nearest(called[lower], index):
            if carries(seconds, _seconds(columns, lower, i), PARTS[part].period_s, 1.0):
                return [start, (lower, i)]
    return [start]


def _upwards(columns: Columns, called: Mapping[str, list[int]], chain: Chain) -> Chain:
    """Return a clock with the columns that count the rounds of what is there, as long as there is one."""
    while np.isfinite(period := max(PARTS[part].period_s for part, _ in chain)) and period < DAY_S:
        lower = np.sum([_seconds(columns, part, i) for part, i in chain], axis=0)
        found = next(
            (
                (part, i)
                for part in UPPERS
                if PARTS[part].worth_s == period
                for i in _nearest([i for i in called[part] if i not in {j for _, j in chain}], chain[0][1])
                if carries(_seconds(columns, part, i), lower, PARTS[part].period_s, period)
            ),
            None,
        )
        if found is None:
            break
        chain = [found, *chain]
    return chain


def _nearest(places: list[int], index: int) -> list[int]:
    return sorted(places, key=lambda i: (abs(i - index), i))


def _numbers(columns: Columns, index: int) -> FloatArray:
    values = as_numbers(columns.take(index))[0]
    return values[np.isfinite(values)]


def _seconds(columns: Columns, part: str, index: int) -> FloatArray:
    return seconds_of_part(columns.take(index), part)
