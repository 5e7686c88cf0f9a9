"""Split a line of text into cells, and tell numbers, dates, clocks, words and missing values apart."""

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
"""Cells by which a spreadsheet or a C library marks that there is no number; their `#` does not begin a comment."""
SENTENCE = re.compile(rb"(?:\A|(?<=\n))[$!][A-Z]{3,}[A-Z0-9]*,[^\n]*")
"""A sentence of NMEA 0183 that another device wrote between the rows."""
MISSING = frozenset({
    "", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf", "-nan", "infinity", "-", "--", "---", "nan(ind)", "-nan(ind)",
    "nan(snan)", "#n/a", "#value!", "#div/0!", "#ref!", "#name?", "#num!", "#null!",
})  # fmt: skip
COMMENTS = "#%"


def cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line, stripped of blanks and quotes."""
    parts = line.split() if separator == "whitespace" else _quoted(line, separator) if '"' in line else line.split(separator)
    return [p.strip().strip("\"'").strip() for p in parts]


def _quoted(line: str, separator: str) -> list[str]:
    """Return the parts of a line with quotes, inside which the separator does not count."""
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [""])
    except csv.Error:  # a quote without an end, or too long a text between two quotes
        return line.split(separator)


def is_row(row: list[str], decimal: str) -> bool:
    """Whether a row is data: it has numbers or dates, at least as many as words, and is no comment."""
    words = sum(is_word(c, decimal) for c in row)
    missing = sum(c.lower() in MISSING for c in row)
    values = len(row) - words - missing
    return values > 0 and words <= values and not row[0].startswith(tuple(COMMENTS))


def is_word(cell: str, decimal: str) -> bool:
    """Whether a cell is neither a number nor a date nor a mark of a missing value."""
    number = _NUMBER if decimal == "." else _COMMA_NUMBER
    return not (number.match(cell) or _DATE.match(cell) or cell.lower() in MISSING)


def is_number_or_date(cell: str) -> bool:
    """Whether a cell is a number or a date, and therefore no name of a column."""
    return bool(_NUMBER.match(cell) or _DATE.match(cell))


def has_number(line: str, separator: str, decimal: str) -> bool:
    """Whether a line of a table has a cell that is neither a word nor missing."""
    return any(not is_word(cell, decimal) and cell.lower() not in MISSING for cell in cells(line, separator))
