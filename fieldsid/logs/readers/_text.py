"""The form of a text table: separator, decimal sign, first line of numbers, header."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from fieldsid.errors import LogError
from fieldsid.logs.channels import TableForm
from fieldsid.logs.strangers import COPY_AGAIN

SEPARATORS = ("\t", ";", ",", "|", "whitespace")
LOOKED_AT = 400
"""Lines at the start of a file among which the first row of numbers must be."""
AGREEING = 20
"""Rows that must have as many cells as the first."""

Score = tuple[int, float, int]
"""Rows that agree with the first, share of its cells that are no words, and its columns."""

_NUMBER = re.compile(r"^[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?$")
_COMMA_NUMBER = re.compile(r"^[+-]?(\d+,\d+|\d+)([eE][+-]?\d+)?$")
_DATE = re.compile(r"^\d{4}-\d\d-\d\d([T ]\d\d:\d\d(:\d\d(\.\d*)?)?)?(Z|[+-]\d\d:?\d\d)?$")
MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf", "-nan", "infinity", "-"})
COMMENTS = "#%"


@dataclass(frozen=True, slots=True)
class Form:
    """How a table is written: `start` is the line of its first row, `names` what the header calls the columns."""

    separator: str
    decimal: str
    start: int
    width: int
    names: tuple[str, ...]

    def label(self, index: int) -> str:
        """The name of a column, or its index where there is no header."""
        return self.names[index] if self.names else str(index)


def form_of(text: str, asked: TableForm, path: Path) -> Form:
    """Find out how a table is written, as far as `asked` leaves it open; raises LogError when there is no row of numbers."""
    lines = text.split("\n", LOOKED_AT + AGREEING)[: LOOKED_AT + AGREEING]
    lines = [line.rstrip("\r") for line in lines]
    first = asked.skip or 0
    best: Form | None = None
    best_score = (0, 0.0, 0)
    for separator in [asked.separator] if asked.separator else SEPARATORS:
        form, score = _try(lines, first, separator, asked)
        if form is not None and score > best_score:
            best, best_score = form, score
    if best is None:
        shown = next((line for line in lines if line.strip()), "")[:80]
        if sum(bool(line.strip()) for line in lines) == 1:
            raise LogError(f"`{path}` has no rows", found=f"one line: {shown!r}", hint=COPY_AGAIN)
        raise LogError(
            f"`{path}` holds no table of numbers",
            found=f"first line: {shown!r}",
            hint="if it is one, say in a mapping how it is written, as `table: {separator: ';', skip: 4}`",
        )
    return best


def _try(lines: list[str], first: int, separator: str, asked: TableForm) -> tuple[Form | None, Score]:
    """Return the form by one separator, and its score."""
    decimals = [asked.decimal] if asked.decimal else ["."] if separator == "," else [".", ","]
    best: tuple[Form | None, Score] = (None, (0, 0.0, 0))
    for decimal in decimals:
        for at in range(first, len(lines)):
            row = cells(lines[at], separator)
            if len(row) < 2 or not _is_row(row, decimal):
                continue
            rows = [r for line in lines[at + 1 : at + AGREEING] if line.strip() and len(r := cells(line, separator)) > 0]
            agreeing = 1 + sum(len(r) == len(row) and _is_row(r, decimal) for r in rows)
            if agreeing * 2 <= len(rows):
                continue
            score = (agreeing, sum(not _is_word(c, decimal) for c in row) / len(row), len(row))
            if score > best[1]:
                names = _header(lines, at, first, separator, len(row), asked=asked.header)
                best = Form(separator, decimal, at, len(row), names), score
            break
    return best


def cells(line: str, separator: str) -> list[str]:
    """Return a line's cells without blanks and quotes."""
    parts = line.split() if separator == "whitespace" else line.split(separator)
    return [p.strip().strip("\"'").strip() for p in parts]


def _is_row(row: list[str], decimal: str) -> bool:
    """Whether a line is data: it holds a number, and what is no number is a date, missing or a word among numbers."""
    words = sum(_is_word(c, decimal) for c in row)
    missing = sum(c.lower() in MISSING for c in row)
    said = len(row) - words - missing
    return said > 0 and words <= said and not row[0].startswith(tuple(COMMENTS))


def _is_word(cell: str, decimal: str) -> bool:
    """Whether a cell is no number, no date and not one of the ways to say that there is none."""
    number = _NUMBER if decimal == "." else _COMMA_NUMBER
    return not (number.match(cell) or _DATE.match(cell) or cell.lower() in MISSING)


def _header(lines: list[str], at: int, first: int, separator: str, width: int, *, asked: bool | None) -> tuple[str, ...]:
    if asked is False:
        return ()
    for i in range(at - 1, max(first, 0) - 1, -1):
        if not lines[i].strip():
            continue
        names = _names(lines[i], separator, width)
        if names:
            return names
        if not lines[i].lstrip().startswith(tuple(COMMENTS)) and not _are_units(lines[i], separator, width):
            return ()
    return ()


def _names(line: str, separator: str, width: int) -> tuple[str, ...]:
    """Return a header line's names when it has one word for each column, else nothing."""
    bare = line.strip().lstrip(COMMENTS).strip() if line.lstrip().startswith(tuple(COMMENTS)) else line
    names = cells(bare, separator)
    if len(names) != width or any(_NUMBER.match(n) or _DATE.match(n) for n in names) or not any(names):
        return ()
    return () if _are_units(line, separator, width) else tuple(names)


def _are_units(line: str, separator: str, width: int) -> bool:
    """Whether a line below the names only states units, such as `[s];[deg];[deg/s]`."""
    parts = cells(line, separator)
    return len(parts) == width and all(p == "" or (p[:1] in "[(" and p[-1:] in "])") for p in parts)
