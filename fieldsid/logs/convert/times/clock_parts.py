"""Combine a time whose parts are in separate columns: `hours`, `minutes`, `seconds`; `hhmm`, `seconds`; `secs`, `nsecs`.

A form such as `hh+mm+ss` names the part in each column, and the time is their sum. In a clock the lower part falls back where
the higher one increases by one; columns that only have the name of a part, such as the hours that a battery lasts, do not.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import MappingError
from fieldsid.logs.convert.number_cells import as_numbers
from fieldsid.logs.convert.times.clock_text import (
    DAY_S,
    FORMS,
    HOUR_S,
    MINUTE_S,
    Clock,
    clock_of_digits,
    clock_of_text,
    made_continuous,
)
from fieldsid.logs.convert.units import UNITS, scaled
from fieldsid.logs.few_of import NEARLY_ALL
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Part:
    """The duration in s of one unit of a column, and the period in s after which the column starts again from zero."""

    worth_s: float
    period_s: float


PARTS: Mapping[str, Part] = MappingProxyType(
    {
        "hh": Part(HOUR_S, DAY_S),
        "mm": Part(MINUTE_S, HOUR_S),
        "ss": Part(1.0, MINUTE_S),
        "s": Part(1.0, np.inf),
        "ds": Part(1e-1, 1.0),
        "cs": Part(1e-2, 1.0),
        **{unit: Part(UNITS[unit].factor, 1.0) for unit in ("ms", "us", "ns")},
        "hhmm": Part(MINUTE_S, DAY_S),
        **{form: Part(1.0, period) for form, period in FORMS.items()},
    }
)
"""Parts of a time in several columns: `s` are seconds that never start again, `ss` are the seconds of a minute."""
PLUS = "+"


def parts_of(form: str | None, columns: Sequence[str | int], place: str = "the mapping") -> tuple[str, ...]:
    """Return the part in each column by a form such as `hh+mm+ss`; raises MappingError where the form does not fit."""
    parts = tuple(part.strip() for part in (form or "").split(PLUS))
    unknown = [part for part in parts if part not in PARTS]
    if not unknown and len(parts) == len(columns):
        return parts
    usual = PLUS.join(("hh", "mm", "ss", "ms")[: len(columns)] if len(columns) != 2 else ("mm", "ss"))
    raise MappingError(
        f"{place}: the unit of a time of {len(columns)} columns says which part of a clock each one is",
        found="no unit" if form is None else f"no part {unknown[0]!r}" if unknown else f"{len(parts)} parts, {form!r}",
        hint=f"write, as `time: {{columns: {json.dumps(list(columns))}, unit: {usual}}}`, of: {', '.join(PARTS)}",
    )


def seconds_of_part(cells: npt.NDArray[Any], part: str) -> FloatArray:
    """Return the seconds (n,) that a column adds to a time, NaN where a cell is no number."""
    if part in FORMS:
        clock = clock_of_text(cells, part) if cells.dtype.kind == "O" and part != "hhmmss" else None
        return clock.seconds if clock is not None else clock_of_digits(as_numbers(cells)[0]).seconds
    numbers = as_numbers(cells)[0]
    if part == "hhmm":
        return clock_of_digits(100.0 * numbers).seconds
    return scaled(numbers, PARTS[part].worth_s)


def clock_of_parts(columns: Sequence[npt.NDArray[Any]], parts: Sequence[str]) -> Clock:
    """Return the clock that is the sum of several columns (n,)."""
    seconds = sum((seconds_of_part(cells, part) for cells, part in zip(columns, parts, strict=True)), np.zeros(columns[0].size))
    return Clock(np.asarray(seconds), max(PARTS[part].period_s for part in parts))


def carries(upper: FloatArray, lower: FloatArray, upper_period_s: float, lower_period_s: float) -> bool:
    """Whether an upper part of a clock (n,) in s increases where a lower one falls back, and elsewhere only across gaps.

    The upper part must be a multiple of the lower one's period, and the lower part must lie within one period.
    """
    seen = np.isfinite(upper) & np.isfinite(lower)
    high, low = upper[seen] / lower_period_s, lower[seen]
    if high.size < 2 or bool((np.abs(high - np.round(high)) > 1e-6).any()) or bool((high < 0.0).any()):
        return False
    if float(low.min()) < 0.0 or float(low.max()) > lower_period_s:
        return False
    steps = np.diff(made_continuous(upper[seen] + low, upper_period_s)[0])
    falls, changes = np.diff(low) < -0.5 * lower_period_s, np.diff(high) != 0.0
    either = falls | changes
    if not either.any():
        return True
    is_slow, rises = float(np.median(steps)) > 0.5 * lower_period_s, float((steps[either] >= 0.0).mean())
    return rises >= NEARLY_ALL and (is_slow or 2 * int((falls & changes).sum()) >= int(either.sum()))


def put_together(names: Sequence[str], parts: Sequence[str], dates: Sequence[str]) -> Note:
    """Return the note that states which columns were added up to a time."""
    columns = [f"`{name}` ({part})" for name, part in zip(names, parts, strict=True)]
    days = f", and the days from {', '.join(f'`{name}`' for name in dates)}" if dates else ""
    message = f"the time is put together from {', '.join(columns)}{days}"
    return Note("clock_parts", message, {"columns": list(names), "parts": list(parts), "dates": list(dates)})
