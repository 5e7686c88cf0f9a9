"""Find the columns of a table that are the parts of one clock: `hours`, `minutes`, `seconds`; `H`, `M`, `S`; year to second.

The name of a column only proposes a part; its numbers must confirm it: the upper part has whole numbers, and increases where the
lower part falls back. Of several columns with the name of a part, the one nearest to the other parts is taken.
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
from fieldsid.logs.convert.units import SPELLINGS
from fieldsid.logs.mapping.canonical_names import words_of
from fieldsid.logs.mapping.vocabulary import TIME, word_set
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.readers._columns import Columns
from fieldsid.numerics.arrays import FloatArray

UNITS_OF_PARTS = {"ss": "s", "ms": "ms", "us": "us", "ns": "ns", "mm": "min", "hh": "h", "yearday": "d"}
"""Unit of a column that has the name of a part of a clock, but never starts again from zero."""
NAMES_OF_PARTS: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "year": word_set("year years yr yyyy yy y jahr"),
        "month": word_set("month months mon mo mm m monat"),
        "day": word_set("day days dd dy d tag"),
        "yearday": word_set("doy yday jday yearday jd ddd"),
        "ds": word_set("decisecond deciseconds tenth tenths"),
        "cs": word_set("centisecond centiseconds centi hundredth hundredths hsec csec"),
        "hhmm": word_set("hhmm"),
        "hhmmss": word_set("hhmmss"),
    }
    | {
        part: word_set(also).union(text for text, unit in SPELLINGS["time"].items() if unit.name == UNITS_OF_PARTS[part])
        for part, also in (
            ("hh", "hh stunde stunden"), ("mm", "mm m mn mi minuten"), ("ss", "ss sekunde sekunden"), ("ms", "milli"),
            ("us", "micro"), ("ns", "nano"),
        )
    }
)  # fmt: skip
"""Names of the parts of a date and a clock; a month and a minute may have the same name."""
IGNORED_WORDS = word_set("time timestamp stamp header clock utc gps gnss gmt rtc local log pc unix unixtime epoch posix")
"""Words that a name may contain in addition to the name of a part."""
DATES = word_set("date datum day yyyymmdd ddmmyy ddmmyyyy yymmdd")
"""Words in the name of a column of dates."""
FRACTIONS = ("ms", "us", "ns", "cs", "ds")
"""Parts that may be the fraction of whole seconds."""
UPPERS = ("hhmm", "mm", "hh")
"""Parts that may count the periods of the parts below them."""
_BEHIND = re.compile(r"[\[(].*|[ _]of[ _].*", re.IGNORECASE)
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")

Chain = list[tuple[str, int]]
"""Parts of a clock and their columns, in the order from the longest unit to the shortest."""


def clocks_in_parts(columns: Columns) -> Iterator[Source]:
    """Yield the clocks that are the sum of several columns of a table, with the columns of their dates."""
    candidates = _columns_of_parts(columns)
    for start in _starts(columns, candidates):
        chain = _upwards(columns, candidates, _downwards(columns, candidates, start))
        places = tuple(index for _, index in chain)
        date = dates_beside(columns, places) if max(PARTS[part].period_s for part, _ in chain) == DAY_S else ()
        if len(chain) > 1 or len(date) > 1:
            unit = PLUS.join(part for part, _ in chain)
            yield Source(columns=tuple(map(columns.place, places)), unit=unit, date=tuple(map(columns.place, date)))


def elapsed(columns: Columns) -> Iterator[tuple[int, str]]:
    """Yield the columns that are named by a unit of time, such as `minutes`, with that unit."""
    candidates = _columns_of_parts(columns)
    for part, unit in UNITS_OF_PARTS.items():
        yield from ((i, unit) for i in candidates[part] if len(columns.name(i)) > 1)


def dates_beside(columns: Columns, clock: tuple[int, ...]) -> tuple[int, ...]:
    """Return the columns of the dates of a clock: one column; year, month and day; or year and day of the year.

    The result is empty where there are none. `clock` are the columns of the clock.
    """
    dated = [(i,) for i, name in enumerate(columns.names) if DATES & set(words := words_of(name)) and "time" not in words]
    free = {part: [i for i in places if i not in clock] for part, places in _columns_of_parts(columns).items()}
    parts: list[tuple[int, ...]] = []
    for year in _nearest(free["year"], clock[0]):
        days = _nearest(free["day"], year)
        parts += [(year, month, day) for month in _nearest(free["month"], year) for day in days if day != month]
        parts += [(year, day) for day in _nearest(free["yearday"], year)]
    return next((c for c in (*dated, *parts) if days_of_columns([columns.take(i) for i in c]) is not None), ())


def _columns_of_parts(columns: Columns) -> dict[str, list[int]]:
    """Return by part the columns that have its name."""
    found: dict[str, list[int]] = {part: [] for part in NAMES_OF_PARTS}
    for i, name in enumerate(columns.names):
        words = {w.lower() for w in _WORD.findall(_BEHIND.sub("", name))} - IGNORED_WORDS
        for part, known in NAMES_OF_PARTS.items():
            if words and (words <= known or (words - known == {"second"} and part in FRACTIONS)):
                found[part].append(i)
    return found


def _starts(columns: Columns, candidates: Mapping[str, list[int]]) -> Iterator[tuple[str, int]]:
    """Yield the columns from which the search for a clock may start: its seconds, else minutes or hours with a fraction."""
    for i in candidates["ss"]:
        seen = _numbers(columns, i)
        if seen.size:
            yield ("ss" if float(seen.max()) <= MINUTE_S else "s"), i
    for i in candidates["hhmmss"]:
        yield "hhmmss", i
    for i, name in enumerate(columns.names) if candidates["ms"] or candidates["us"] else ():
        meaning = meaning_of(name)
        if meaning is not None and meaning[0] == TIME and columns.take(i).dtype.kind == "O":
            clock = clock_of_text(columns.take(i))
            if clock is not None and clock.period_s == DAY_S:
                yield "hh:mm:ss", i
    for part in ("mm", "hh"):
        for i in candidates[part]:
            if bool((_numbers(columns, i) % 1.0 != 0.0).any()):
                yield part, i


def _downwards(columns: Columns, candidates: Mapping[str, list[int]], start: tuple[str, int]) -> Chain:
    """Return the starting part, followed by the column of the fraction of its whole seconds where there is one."""
    part, index = start
    seconds = _seconds(columns, part, index)
    seen = seconds[np.isfinite(seconds)]
    if bool((seen != np.round(seen)).any()):
        return [start]
    for lower in FRACTIONS:
        for i in _nearest(candidates[lower], index):
            if carries(seconds, _seconds(columns, lower, i), PARTS[part].period_s, 1.0):
                return [start, (lower, i)]
    return [start]


def _upwards(columns: Columns, candidates: Mapping[str, list[int]], chain: Chain) -> Chain:
    """Return a clock extended by the columns that count the periods of its longest part, as far as there are such columns."""
    while np.isfinite(period := max(PARTS[part].period_s for part, _ in chain)) and period < DAY_S:
        lower = np.sum([_seconds(columns, part, i) for part, i in chain], axis=0)
        found = next(
            (
                (part, i)
                for part in UPPERS
                if PARTS[part].worth_s == period
                for i in _nearest([i for i in candidates[part] if i not in {j for _, j in chain}], chain[0][1])
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
