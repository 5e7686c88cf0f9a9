"""The form of a text table: separator, decimal sign, first line of numbers, header."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fieldsid.errors import LogError
from fieldsid.logs.channels import TableForm
from fieldsid.logs.readers._cells import SENTENCE, cells, is_row, is_word
from fieldsid.logs.readers._header import behind_sizes, header_of
from fieldsid.logs.unknown_file import COPY_AGAIN, known_text

SEPARATORS = ("\t", ";", ",", "|", "whitespace")
LOOKED_AT = 400
"""Lines at the start of a file among which the first row of numbers must be."""
AGREEING = 20
"""Rows that must have as many cells as the first."""

Score = tuple[int, float, int]
"""Rows that agree with the first, share of its cells that are no words, and its columns."""


@dataclass(frozen=True, slots=True)
class Form:
    """How a table is written: `start` is the line of its first row, `names` and `units` what is said above."""

    separator: str
    decimal: str
    start: int
    width: int
    names: tuple[str, ...]
    units: tuple[str, ...] = ()

    is_sentences: bool = False

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


def _try(lines: list[str], first: int, separator: str, asked: TableForm) -> tuple[Form | None, Score]:
    """Return the form by one separator, and its score."""
    only_points = separator == "," and not any('"' in line for line in lines[first:])
    decimals = [asked.decimal] if asked.decimal else ["."] if only_points else [".", ","]
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
                names, units = header_of(lines, at, first, separator, len(row), asked=asked.header)
                said = SENTENCE.match(lines[at].encode()) is not None
                best = Form(separator, decimal, behind_sizes(lines, at, names), len(row), names, units, said), score
            break
    return best
