"""Cells of a line of text: numbers, dates, clocks, words, and the ways to say that there is none."""

from __future__ import annotations

import csv
import re

from fieldsid.logs.convert.times.clock_text import CLOCK
from fieldsid.logs.convert.times.dates import DATE

_NUMBER = re.compile(r"^[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?$")
_COMMA_NUMBER = re.compile(r"^[+-]?(\d+,\d+|\d+)([eE][+-]?\d+)?$")
_DATE = re.compile(
    rf"^(\d{{4}}-\d\d-\d\d([T ]\d\d:\d\d(:\d\d(\.\d*)?)?)?(Z|[+-]\d\d:?\d\d)?|{DATE.pattern}|({DATE.pattern} )?{CLOCK.pattern})$"
)
ERRORS = re.compile(
    rb"(?<![^,;\t|\n\" ])(?:#(?:N/A|VALUE!|DIV/0!|REF!|NAME\?|NUM!|NULL!)(?=[,;\t|\r\n\" ]|$)|#{3,}(?=\"? *[,;\t|])"
    rb"|-?\d+\.#(?:QNAN|SNAN|IND|INF)\d*)"
)
"""Cells in which a spreadsheet or a C library says that there is no number, which are no comments."""
SENTENCE = re.compile(rb"(?:\A|(?<=\n))[$!][A-Z]{3,}[A-Z0-9]*,[^\n]*")
"""A line of NMEA 0183, which another talker wrote among the rows."""
MISSING = frozenset({
    "", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf", "-nan", "infinity", "-", "--", "---", "nan(ind)", "-nan(ind)",
    "nan(snan)", "#n/a", "#value!", "#div/0!", "#ref!", "#name?", "#num!", "#null!",
})  # fmt: skip
COMMENTS = "#%"


def cells(line: str, separator: str) -> list[str]:
    """Return a line's cells without blanks and quotes."""
    parts = line.split() if separator == "whitespace" else _quoted(line, separator) if '"' in line else line.split(separator)
    return [p.strip().strip("\"'").strip() for p in parts]


def _quoted(line: str, separator: str) -> list[str]:
    """Return the parts of a line of which some are in quotes, and may hold the separator there."""
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [""])
    except csv.Error:  # a quote without its end, or too much between two
        return line.split(separator)


def is_row(row: list[str], decimal: str) -> bool:
    """Whether a line is data: it holds a number, and what is no number is a date, missing or a word among numbers."""
    words = sum(is_word(c, decimal) for c in row)
    missing = sum(c.lower() in MISSING for c in row)
    said = len(row) - words - missing
    return said > 0 and words <= said and not row[0].startswith(tuple(COMMENTS))


def is_word(cell: str, decimal: str) -> bool:
    """Whether a cell is no number, no date and not one of the ways to say that there is none."""
    number = _NUMBER if decimal == "." else _COMMA_NUMBER
    return not (number.match(cell) or _DATE.match(cell) or cell.lower() in MISSING)


def is_number_or_date(cell: str) -> bool:
    """Whether a cell is no name of a column."""
    return bool(_NUMBER.match(cell) or _DATE.match(cell))


def has_number(line: str, separator: str, decimal: str) -> bool:
    """Whether a line of a table holds anything but words and empty cells."""
    return any(not is_word(cell, decimal) and cell.lower() not in MISSING for cell in cells(line, separator))
