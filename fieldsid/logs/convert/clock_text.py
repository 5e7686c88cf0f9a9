"""Times written as on a clock: `hh:mm:ss.s`, `mm:ss.s` that starts again each hour, dates before or beside them.

What a clock leaves out is put back by its going on: where it falls back by more than half of what it counts to (a day, or an
hour where a spreadsheet has dropped the hours), the next one has begun.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

if TYPE_CHECKING:
    from pandas import Series

DAY_S, HOUR_S, WEEK_S = 86400.0, 3600.0, 604800.0
FORMS = {"hh:mm:ss": DAY_S, "mm:ss": HOUR_S, "hh:mm": DAY_S, "hhmmss": DAY_S}
"""How a clock may be written where a mapping says so as the unit of time, and the seconds after which it starts again."""
CLOCK = re.compile(r"(?:(\d{1,2}):)?(\d{1,3}):(\d{1,2}(?:[.,]\d*|:\d{3})?)\s*([AaPp])?[Mm]?")
DATE = re.compile(r"(\d{1,4})([-/.])(\d{1,2}|[A-Za-z]{3})[-/.](\d{1,4})")
MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
MOSTLY = 0.5
"""Share of the cells that must be of a form for a column to be taken for it."""
LONGEST_YEAR = 4


@dataclass(frozen=True, slots=True)
class Clock:
    """Seconds (n,) that a clock shows, NaN where a cell is none, and those after which it starts again."""

    seconds: FloatArray
    period_s: float


def clock_of_text(cells: npt.NDArray[Any], form: str | None = None) -> Clock | None:
    """Return what a column of clock readings shows; None where less than half of the cells are readings."""
    parts = _texts(cells).str.extract(f"^{CLOCK.pattern}$")
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
    whole = seconds.copy()
    whole[seen] += period_s * rounds
    return whole, int(rounds[-1]) if rounds.size else 0


def days_of(cells: npt.NDArray[Any]) -> FloatArray | None:
    """Return the days (n,) since 1970 of a column of dates, NaN where a cell is none; None where less than half are.

    Year, month and day as ISO 8601 has them, day before month or month before day: of the two that which goes on with the
    fewest days, and month first where both do.
    """
    parts = _texts(cells).str.extract(f"^{DATE.pattern}$")
    if parts[0].notna().mean() <= MOSTLY:
        return None
    a, b, c = (_month_numbers(parts[i]) for i in (0, 2, 3))
    named = parts[2].str.isalpha().fillna(value=False).any()
    is_iso = bool((parts[0].str.len() == LONGEST_YEAR).any())
    orders = [(a, b, c)] if is_iso else [(c, b, a)] if named else [(c, a, b), (c, b, a)]
    found = [days for order in orders if np.isfinite(days := _days(*order)).any()]
    return min(found, key=lambda d: (int(np.isnan(d).sum()), float(np.nanmax(d) - np.nanmin(d)))) if found else None


def stamps_of_text(cells: npt.NDArray[Any]) -> FloatArray | None:
    """Return the seconds (n,) since 1970 of cells with a date and a clock in one; None where less than half are."""
    parts = _texts(cells).str.split(r"[ T]+", n=1, regex=True, expand=True)
    if parts.shape[1] < 2:
        return None
    days, clock = days_of(parts[0].to_numpy(dtype=object)), clock_of_text(parts[1].to_numpy(dtype=object))
    return None if days is None or clock is None else DAY_S * days + clock.seconds


def lost_hours(name: str, times: int) -> Note:
    """Return the note that hours were added to a clock without them."""
    again = f"; it starts again {times} time{'s' * (times != 1)}, each taken for the next hour" if times else ""
    return Note("lost_hours", f"`{name}` counts minutes and seconds, the hour is not in it{again}", {"count": times})


def _texts(cells: npt.NDArray[Any]) -> Series[str]:
    import pandas as pd

    return pd.Series(cells).astype("string").str.strip()


def _month_numbers(texts: Series[str]) -> FloatArray:
    """Return numbers (n,) of texts, a month's name as its number."""
    import pandas as pd

    named = texts.str.lower().map({name: i + 1.0 for i, name in enumerate(MONTHS)})
    return np.asarray(pd.to_numeric(texts, errors="coerce").fillna(named).to_numpy(dtype=np.float64, na_value=np.nan))


def _days(year: FloatArray, month: FloatArray, day: FloatArray) -> FloatArray:
    import pandas as pd

    full = np.where(year < 100.0, np.where(year < 70.0, 2000.0, 1900.0) + year, year)
    stamps = pd.to_datetime(pd.DataFrame({"year": full, "month": month, "day": day}), errors="coerce")
    days = stamps.to_numpy(dtype="datetime64[D]")
    return np.where(np.isnat(days), np.nan, days.astype(np.int64).astype(np.float64))
