"""Find the form of a text table: separator, decimal sign, first line of numbers, and names and units above it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from fieldsid.errors import LogError
from fieldsid.logs.channels import TableForm
from fieldsid.logs.convert.units import find_unit
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.readers._cells import COMMENTS, SENTENCE, cells, is_number_or_date, is_row, is_word
from fieldsid.logs.unknown_file import COPY_AGAIN, known_text

OTHER_UNITS = frozenset({
    "timestamp", "utc", "nodim", "enum", "bool", "volts", "v", "amps", "a", "ah", "mah", "w", "wh", "degc", "hz", "count",
    "counts", "pwm", "lat", "lon", "byte", "bit", "byte/s", "s/m", "cc", "m^3", "kg", "kg/m3", "m/s2", "m/s^2", "m/s/s", "nm",
    "n.m", "ppm", "psu", "ntu", "ug/l", "inhg", "torr", "datenum",
})  # fmt: skip
"""Units in rows of units that belong to no signal of the package."""


SEPARATORS = ("\t", ";", ",", "|", "whitespace")
_RULE = re.compile(r"^[\s|+:=-]*[-=]{2,}[\s|+:=-]*$")
"""A line of dashes or equal signs below the names."""

_WITH_UNIT = re.compile(r"[^\s\[(]\S*(?:\s+(?:\[[^\]]*\]|\([^)]*\)))?")


def header_of(
    lines: list[str], at: int, first: int, separator: str, width: int, *, stated: bool | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names and the units of the columns; a row of units is looked for below the names.

    `at` is the line of the first row of numbers, `first` the first line that may belong to the table.
    """
    if stated is False:
        return (), ()
    names, units = _header_above(lines, at, first, separator, width)
    if not names and width > 2 and cells(lines[at], separator)[-1] == "":
        # rows that end in a separator have one cell more than the header has names
        names, units = _header_above(lines, at, first, separator, width - 1)
        return (*names, "") if names else (), (*units, "") if units else ()
    return names, units


def _header_above(lines: list[str], at: int, first: int, separator: str, width: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    units: tuple[str, ...] = ()
    for i in range(at - 1, max(first, 0) - 1, -1):
        if not lines[i].strip() or _RULE.match(lines[i]):
            continue
        names = _names(lines[i], separator, width)
        if names and not units and _state_units(names) and any(_names(up, separator, width) for up in lines[max(first, 0) : i]):
            units = names
        elif names:
            return names, units
        elif _are_units(lines[i], separator, width):
            units = tuple(cells(lines[i], separator))
        elif not lines[i].lstrip().startswith(tuple(COMMENTS)):
            return (), ()
    return (), ()


def _state_units(names: tuple[str, ...]) -> bool:
    """Whether more than half of the words of a line, and at least two, are units of measurement."""
    words = [name for name in names if name]
    known = sum(find_unit(name) is not None or name.lower() in OTHER_UNITS for name in words)
    return known > 1 and 2 * known > len(words)


def first_data_line(lines: list[str], at: int, names: tuple[str, ...]) -> int:
    """Return the line of the first row of data; in a glider's table it follows a row with the bytes of each column."""
    head = {key.strip(): value.strip() for key, colon, value in (line.partition(":") for line in lines[:at]) if colon}
    return at + 1 if names and head.get("num_label_lines") == "3" else at


def _names(line: str, separator: str, width: int) -> tuple[str, ...]:
    """Return the names in a header line if it has one for each column, else nothing."""
    bare = line.strip().lstrip(COMMENTS).strip() if line.lstrip().startswith(tuple(COMMENTS)) else line
    names = cells(bare, separator)
    if separator == "whitespace":
        names = [n.strip(",;|") for n in names]
    if len(names) != width and separator == "whitespace":
        # names of several words are separated by at least two blanks
        names = [n.strip() for n in re.split(r"\s{2,}|\t", bare.strip())]
    if len(names) != width and separator == "whitespace":
        # a unit in brackets belongs to the word before it, in columns of a fixed width that a long name may fill
        names = _WITH_UNIT.findall(bare)
    if len(names) != width:
        names = _split_by_other(bare, separator, width)
    if len(names) != width or any(is_number_or_date(n) for n in names) or not any(names):
        return ()
    return () if _are_units(line, separator, width) else tuple(names)


def _split_by_other(line: str, separator: str, width: int) -> list[str]:
    """Return the words of a header that has another separator than the rows, if they name signals or units; else nothing."""
    for other in SEPARATORS:
        words = cells(line, other) if other != separator else []
        if len(words) == width and (_state_units(tuple(words)) or sum(meaning_of(w) is not None for w in words) > 1):
            return words
    return []


def _are_units(line: str, separator: str, width: int) -> bool:
    """Whether a line below the names has only units in brackets, such as `[s];[deg];[deg/s]`."""
    parts = cells(line, separator)
    return len(parts) == width and all(p == "" or (p[:1] in "[(" and p[-1:] in "])") for p in parts)


LOOKED_AT = 400
"""Number of lines at the start of a file among which the first row of numbers must be."""
AGREEING = 20
"""Number of rows whose number of cells is compared with that of the first row."""

Score = tuple[int, float, int]
"""Number of rows that agree with the first, share of its cells that are no words, and its number of columns."""


@dataclass(frozen=True, slots=True)
class Form:
    """The form of a table: `start` is the line of its first row; `names` and `units` are from the header above."""

    separator: str
    decimal: str
    start: int
    width: int
    names: tuple[str, ...]
    units: tuple[str, ...] = ()
    is_sentences: bool = False


def form_of(text: str, stated: TableForm, path: Path) -> Form:
    """Return the form of a table, found as far as the mapping leaves it open; raises LogError when there is no row of numbers.

    `stated` is the form by the mapping.
    """
    lines = text.split("\n", LOOKED_AT + AGREEING)[: LOOKED_AT + AGREEING]
    lines = [line.rstrip("\r") for line in lines]
    first = stated.skip or 0
    best: Form | None = None
    best_score = (0, 0.0, 0)
    for separator in [stated.separator] if stated.separator else SEPARATORS:
        form, score = _try(lines, first, separator, stated)
        if form is not None and score > best_score:
            best, best_score = form, score
    # sentences of several kinds have no columns in common
    is_mixed = best is not None and best.is_sentences and len({line.partition(",")[0] for line in lines if line.strip()}) > 1
    if (best is None or is_mixed) and (known := known_text(path, lines)) is not None:
        raise known
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


def _try(lines: list[str], first: int, separator: str, stated: TableForm) -> tuple[Form | None, Score]:
    """Return the best form with one separator, and its score."""
    only_points = separator == "," and not any('"' in line for line in lines[first:])
    decimals = [stated.decimal] if stated.decimal else ["."] if only_points else [".", ","]
    best: tuple[Form | None, Score] = (None, (0, 0.0, 0))
    for decimal in decimals:
        for at in range(first, len(lines)):
            row = cells(lines[at], separator)
            if len(row) < 2 or not is_row(row, decimal):
                continue
            rows = [r for line in lines[at + 1 : at + AGREEING] if line.strip() and len(r := cells(line, separator)) > 0]
            agreeing = 1 + sum(len(r) == len(row) and is_row(r, decimal) for r in rows)
            if agreeing * 2 <= len(rows):
                continue
            score = (agreeing, sum(not is_word(c, decimal) for c in row) / len(row), len(row))
            if score > best[1]:
                names, units = header_of(lines, at, first, separator, len(row), stated=stated.header)
                is_nmea = SENTENCE.match(lines[at].encode()) is not None
                best = Form(separator, decimal, first_data_line(lines, at, names), len(row), names, units, is_nmea), score
            break
    return best
