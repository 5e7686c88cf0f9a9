"""Refuse a table whose rows are those of several vehicles or sensors in turn, as of a fleet with a column that names each.

Read as one, the heading jumps from row to row from one vehicle to the other, and no number found from it belongs to either.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.convert.number_cells import as_numbers
from fieldsid.logs.convert.units import CLEARLY
from fieldsid.logs.few_of import few_of
from fieldsid.logs.readers._cells import cells
from fieldsid.logs.readers._text import LOOKED_AT, Form
from fieldsid.numerics.arrays import FloatArray

OF_ROWS = 3
"""Fewest rows per distinct cell of a column that names sources, and largest number per distinct number of one that varies."""


def refuse_rows_of_several(path: Path, form: Form, head: str, used: Iterable[int]) -> None:
    """Raise LogError where a column names a source for each row, and a used column goes on within each, but not between rows."""
    lines = [line for line in head.splitlines()[form.start :][:LOOKED_AT] if len(cells(line, form.separator)) == form.width]
    columns = list(zip(*(cells(line, form.separator) for line in lines), strict=True))
    numbers = {i: as_numbers(np.array(columns[i], dtype=object))[0] for i in used} if len(lines) > OF_ROWS else {}
    varying = {i: v for i, v in numbers.items() if OF_ROWS * np.unique(v[np.isfinite(v)]).size > v.size}
    for place, tags in enumerate(columns if varying else ()):
        if not 1 < len(set(tags)) <= len(tags) / OF_ROWS or 2 * sum(map(str.__ne__, tags, tags[1:])) < len(tags):
            continue
        found = next((i for i, v in varying.items() if i != place and _goes_on_within(np.array(tags), v)), None)
        if found is not None:
            raise _refusal(path, form, lines, place, found)


def _goes_on_within(tags: np.ndarray[tuple[int], np.dtype[np.str_]], values: FloatArray) -> bool:
    """Return whether the steps of values (n,) between rows are clearly larger than those within the rows of each tag (n,)."""
    within = np.concatenate([np.abs(np.diff(values[tags == source])) for source in np.unique(tags)])
    between = np.abs(np.diff(values))
    if not (np.isfinite(within).any() and np.isfinite(between).any()):
        return False
    return float(np.nanmedian(between)) > CLEARLY * float(np.nanmedian(within))


def _refusal(path: Path, form: Form, lines: list[str], place: int, jumps: int) -> LogError:
    names = form.names or tuple(f"column {i}" for i in range(form.width))
    sources = sorted({cells(line, form.separator)[place] for line in lines})
    shown = few_of([f"`{source}`" for source in sources])
    return LogError(
        f"`{path}` holds the rows of several in turn: `{names[place]}` is {shown}",
        found=f"`{names[jumps]}` goes on within each, and jumps from row to row between them",
        hint=f"give each a table of its own{_command(path, form, lines[0], place)}",
    )


def _command(path: Path, form: Form, line: str, place: int) -> str:
    """Return the command that writes the rows of the first source into a table; empty where a line is not so easily split."""
    cell = line.split(form.separator)[place] if form.separator != "whitespace" else line.split()[place]
    if '"' in line or "\\" in cell or place == form.width - 1 or path.suffix == ".gz":
        return ""
    between = [] if form.separator == "whitespace" else [f"-F{form.separator}"]
    words = ["awk", *between, f'NR <= {form.start} || ${place + 1} == "{cell}"', str(path)]
    return f": `{shlex.join(words)} > one.csv`"
