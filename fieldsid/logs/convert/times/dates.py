"""Convert dates to days since 1970: in one cell, with any separator or as digits, or as year, month and day in columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.number_cells import as_numbers
from fieldsid.logs.few_of import MOSTLY
from fieldsid.numerics.arrays import FloatArray

if TYPE_CHECKING:
    from pandas import Series

DATE = re.compile(r"(\d{1,4})([-/.])(\d{1,2}|[A-Za-z]{3})[-/.](\d{1,4})")
OF_WEEK_OR_YEAR = r"\d{4}-(?:W\d\d-\d|\d{3})"
"""2024-W09-5, the fifth day of a week, and 2024-061, the 61st day of a year."""
MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
YEARS = (1970, 2100)
"""Years that a date of a log may have, the last one excluded; a clock that was never set starts with the first."""


def days_of(cells: npt.NDArray[Any]) -> FloatArray | None:
    """Return the days (n,) since 1970 of a column of dates, NaN where a cell is none; None where less than half are dates.

    Accepts year, month and day in the order of ISO 8601, day before month, month before day, eight or six digits, and week or day
    of the year. Of several possible orders the one with the fewest cells that are no dates is taken, then the one that spans the
    fewest days, then the one with the month first.
    """
    digits = _digits(cells)
    if digits is not None:
        return _of_digits(digits)
    words = texts(cells)
    if words.str.fullmatch(OF_WEEK_OR_YEAR).fillna(value=False).mean() > MOSTLY:
        by_week = stamps_in(words, ("%G-W%V-%u", "%Y-%j"))
        return None if by_week is None else _as_days(by_week)
    parts = words.str.extract(f"^{DATE.pattern}$")
    if parts[0].notna().mean() <= MOSTLY:
        return None
    a, b, c = (_month_numbers(parts[i]) for i in (0, 2, 3))
    named = parts[2].str.isalpha().fillna(value=False).any()
    is_iso = bool((parts[0].str.len() == len("yyyy")).any())
    return _likeliest([(a, b, c)] if is_iso else [(c, b, a)] if named else [(c, a, b), (c, b, a)])


def days_of_columns(columns: Sequence[npt.NDArray[Any]]) -> FloatArray | None:
    """Return the days (n,) since 1970 of dates in one column, of year and day of the year, or of year, month and day."""
    if len(columns) == 1:
        return days_of(columns[0])
    year = as_numbers(columns[0])[0]
    month, day = (np.ones(year.size), as_numbers(columns[1])[0]) if len(columns) == 2 else (as_numbers(c)[0] for c in columns[1:])
    if len(columns) == 2:
        first = _days(year, month, np.ones(year.size))
        found = first + np.where((day >= 1.0) & (day < 367.0), np.floor(day) - 1.0, np.nan)
    else:
        found = _days(year, month, day)
    return found if np.isfinite(found).mean() > MOSTLY else None


def texts(cells: npt.NDArray[Any]) -> Series[str]:
    """Return cells (n,) as text without blanks at their ends."""
    import pandas as pd

    return pd.Series(cells).astype("string").str.strip()


def stamps_in(words: Series[str], forms: Sequence[str]) -> npt.NDArray[np.datetime64] | None:
    """Return the stamps (n,) of texts by the first form that most of them have, NaT for the others; None without such a form."""
    import pandas as pd

    found = (pd.to_datetime(words, format=form, errors="coerce").to_numpy(dtype="datetime64[us]") for form in forms)
    return next((stamps for stamps in found if np.isnat(stamps).mean() < 1.0 - MOSTLY), None)


def _digits(cells: npt.NDArray[Any]) -> FloatArray | None:
    """Return the numbers (n,) of dates that are written as digits alone; None where they are not."""
    numbers, wrong = as_numbers(cells)
    seen = numbers[np.isfinite(numbers)]
    if wrong.size > MOSTLY * cells.size or not seen.size:
        return None
    return numbers if bool((seen == np.round(seen)).all()) and float(seen.min()) >= 100.0 else None


def _of_digits(numbers: FloatArray) -> FloatArray | None:
    """Return the days (n,) of dates such as 20240301, 01032024, 240301, or 010324 as satellite receivers write it."""
    long = float(np.nanmax(numbers)) >= 1e6
    first, middle, last = np.floor(numbers / 1e4), np.floor(numbers / 1e2) % 100.0, numbers % 100.0
    orders = [(last, middle, first), (first, middle, last), (last, first, middle)]
    if long:
        day, month, year = np.floor(numbers / 1e6), np.floor(numbers / 1e4) % 100.0, numbers % 1e4
        orders = [(first, middle, last), (year, day, month), (year, month, day)]
    return _likeliest([order for order in orders if _are_years(order[0], long=long)])


def _are_years(numbers: FloatArray, *, long: bool) -> bool:
    """Whether most numbers (n,) are plausible years of a log, of four digits where `long`, else of two."""
    low, high = YEARS if long else (0.0, 100.0)
    return float(((numbers >= low) & (numbers < high)).mean()) > MOSTLY


def _likeliest(orders: Sequence[tuple[FloatArray, FloatArray, FloatArray]]) -> FloatArray | None:
    """Return the days (n,) by the likeliest of some orders of year, month and day; None where none gives a date."""
    found = [days for order in orders if np.isfinite(days := _days(*order)).any()]
    return min(found, key=lambda d: (int(np.isnan(d).sum()), float(np.nanmax(d) - np.nanmin(d)))) if found else None


def _month_numbers(months: Series[str]) -> FloatArray:
    """Return texts (n,) as numbers, with the name of a month as its number."""
    import pandas as pd

    named = months.str.lower().map({name: i + 1.0 for i, name in enumerate(MONTHS)})
    return np.asarray(pd.to_numeric(months, errors="coerce").fillna(named).to_numpy(dtype=np.float64, na_value=np.nan))


def _days(year: FloatArray, month: FloatArray, day: FloatArray) -> FloatArray:
    import pandas as pd

    full = np.where(year < 100.0, np.where(year < 70.0, 2000.0, 1900.0) + year, year)
    stamps = pd.to_datetime(pd.DataFrame({"year": full, "month": month, "day": day}), errors="coerce")
    return _as_days(stamps.to_numpy(dtype="datetime64[us]"))


def _as_days(stamps: npt.NDArray[np.datetime64]) -> FloatArray:
    days = stamps.astype("datetime64[D]")
    return np.where(np.isnat(days), np.nan, days.astype(np.int64).astype(np.float64))
