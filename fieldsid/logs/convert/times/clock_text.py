"""Times written as on a clock: `hh:mm:ss.s`, `mm:ss.s` that starts again each hour, dates before or beside them.

What a clock leaves out is put back by its going on: where it falls back by more than half of what it counts to (a day, or an
hour where a spreadsheet has dropped the hours), the next one has begun.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.times.dates import days_of, texts
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

MINUTE_S, HOUR_S, DAY_S, WEEK_S = 60.0, 3600.0, 86400.0, 604800.0
FORMS = {"hh:mm:ss": DAY_S, "mm:ss": HOUR_S, "hh:mm": DAY_S, "hhmmss": DAY_S}
"""How a clock may be written where a mapping says so as the unit of time, and the seconds after which it starts again."""
CLOCK = re.compile(r"(?:(\d{1,2}):)?(\d{1,3}):(\d{1,2}(?:[.,]\d*|:\d{3})?)\s*([AaPp])?[Mm]?")
MOSTLY = 0.5
"""Share of the cells that must be of a form for a column to be taken for it."""


@dataclass(frozen=True, slots=True)
class Clock:
    """Seconds (n,) that a clock shows, NaN where a cell is none, and those after which it starts again."""

    seconds: FloatArray
    period_s: float


def clock_of_text(cells: npt.NDArray[Any], form: str | None = None) -> Clock | None:
    """Return what a column of clock readings shows; None where less than half of the cells are readings."""
    parts = texts(cells).str.extract(f"^{CLOCK.pattern}$")
    numbers = (parts[i].str.replace(r"[,:]", ".", regex=True) for i in range(3))
    first, second, third = (n.astype("float64").to_numpy(na_value=np.nan) for n in numbers)
    if np.isfinite(third).mean() <= MOSTLY:
        return None
    if form == "hh:mm":
        return Clock(HOUR_S * second + 60.0 * third, DAY_S)
    if not np.isfinite(first).any():
        return Clock(60.0 * second + third, HOUR_S)
    half_day = parts[3].str.lower().map({"a": 0.0, "p": 12.0}).to_numpy(dtype=np.float64)
    hours = np.where(np.isfinite(half_day), first % 12.0 + np.nan_to_num(half_day), first)
    return Clock(HOUR_S * hours + 60.0 * second + third, DAY_S)


def clock_of_digits(numbers: FloatArray) -> Clock:
    """Return what readings written as one number show: 142018.5 is 14:20:18.5."""
    hours, minutes = np.floor(numbers / 1e4), np.floor(numbers / 1e2) % 100.0
    return Clock(HOUR_S * hours + 60.0 * minutes + numbers % 100.0, DAY_S)


def going_on(seconds: FloatArray, period_s: float) -> tuple[FloatArray, int]:
    """Return a clock (n,) that does not start again each `period_s`, and how often it did."""
    seen = np.isfinite(seconds)
    steps = np.diff(seconds[seen], prepend=seconds[seen][:1])
    rounds = np.cumsum(steps < -0.5 * period_s)
    if not rounds.size or not rounds[-1]:
        return seconds, 0
    whole = seconds.copy()
    whole[seen] += period_s * rounds
    return whole, int(rounds[-1])


def stamps_of_text(cells: npt.NDArray[Any]) -> FloatArray | None:
    """Return the seconds (n,) since 1970 of cells with a date and a clock in one; None where less than half are."""
    parts = texts(cells).str.split(r"[ T]+", n=1, regex=True, expand=True)
    if parts.shape[1] < 2:
        return None
    days, clock = days_of(parts[0].to_numpy(dtype=object)), clock_of_text(parts[1].to_numpy(dtype=object))
    return None if days is None or clock is None else DAY_S * days + clock.seconds


def lost_hours(name: str, times: int, period_s: float) -> Note:
    """Return the note that hours, or minutes too, were added to a clock without them."""
    counts, lacks = ("minutes and seconds", "hour") if period_s == HOUR_S else ("seconds", "minute")
    again = f"; it starts again {times} time{'s' * (times != 1)}, each taken for the next {lacks}" if times else ""
    return Note("lost_hours", f"`{name}` counts {counts}, the {lacks} is not in it{again}", {"count": times})
