"""Refuse a table whose rows are those of several vehicles or sensors, as of a fleet with a column that names each.

Read as one, the heading jumps from one vehicle to the other, and no number found from it belongs to either.
"""

from __future__ import annotations

import shlex
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.convert.number_cells import as_numbers
from fieldsid.logs.convert.units import CLEARLY
from fieldsid.logs.few_of import FEW, few_of
from fieldsid.logs.readers._cells import cells
from fieldsid.logs.readers._text import LOOKED_AT, Form
from fieldsid.numerics.arrays import BoolArray, FloatArray

OF_ROWS = 3
"""Fewest rows per distinct cell of a column that names sources, and largest number per distinct number of one that varies."""


def refuse_rows_of_several(
    path: Path,
    form: Form,
    lines: Sequence[str],
    among: Collection[int],
    whole: Sequence[npt.NDArray[Any]] = (),
    time: npt.NDArray[Any] | None = None,
) -> None:
    """Raise LogError where a column names a source for each row, and one `among` some goes on within each, but not between them.

    The sources come in turn, in the first lines or in the `whole` columns (n,); or one after the other, each with a time of its
    own, where the `time` (n,) goes back.
    """
    lines = [line for line in lines[:LOOKED_AT] if len(cells(line, form.separator)) == form.width]
    rows = (cells(line, form.separator) for line in lines)
    columns = whole or [np.array(column, dtype=object) for column in zip(*rows, strict=True)]
    numbers = {i: as_numbers(columns[i])[0] for i in among} if len(lines) > OF_ROWS else {}
    varying = {i: v for i, v in numbers.items() if whole or OF_ROWS * np.unique(v[np.isfinite(v)]).size > v.size}
    for place, tags in enumerate(columns if varying else ()):
        changes = tags[1:] != tags[:-1]
        in_turn = 2 * int(changes.sum()) >= tags.size
        one_by_one = time is not None and bool(changes.any()) and not (changes & ~goes_back(time)).any()
        names = sorted(set(map(str, tags))) if in_turn or one_by_one else []
        if not 1 < len(names) <= tags.size / OF_ROWS:
            continue
        found = next((i for i, v in varying.items() if i != place and _goes_on_within(tags, v, changes)), None)
        if found is not None:
            how = "in turn" if in_turn else "one after the other"
            raise _refusal(path, form, lines[0], names, place, found, how)


def goes_back(time: npt.NDArray[Any]) -> BoolArray:
    """Return a mask (n - 1,) of the steps in which times (n,), as numbers or as text, go back."""
    return np.asarray(time[1:] < time[:-1] if time.dtype.kind != "O" else time[1:].astype(str) < time[:-1].astype(str))


def _goes_on_within(tags: npt.NDArray[Any], values: FloatArray, changes: BoolArray) -> bool:
    """Return whether the steps of values (n,) at the changes of the tag are clearly larger than all but FEW within each (n,)."""
    within = np.concatenate([np.abs(np.diff(values[tags == source])) for source in set(tags)])
    between = np.abs(np.diff(values))[changes]
    if not (np.isfinite(within).any() and np.isfinite(between).any()):
        return False
    return float(np.nanmedian(between)) > CLEARLY * float(np.nanquantile(within, 1.0 - FEW)) > 0.0


def _refusal(path: Path, form: Form, line: str, sources: Sequence[str], place: int, jumps: int, how: str) -> LogError:
    names = form.names or tuple(f"column {i}" for i in range(form.width))
    return LogError(
        f"`{path}` holds the rows of several {how}: `{names[place]}` is {few_of([f'`{source}`' for source in sources])}",
        found=f"`{names[jumps]}` goes on within each, and jumps between them",
        hint=f"give each a table of its own{_command(path, form, line, place)}",
    )


def _command(path: Path, form: Form, line: str, place: int) -> str:
    """Return the command that writes the rows of the first source into a table; empty where a line is not so easily split."""
    cell = line.split(form.separator)[place] if form.separator != "whitespace" else line.split()[place]
    if '"' in line or "\\" in cell or place == form.width - 1 or path.suffix == ".gz":
        return ""
    between = [] if form.separator == "whitespace" else [f"-F{form.separator}"]
    words = ["awk", *between, f'NR <= {form.start} || ${place + 1} == "{cell}"', str(path)]
    return f": `{shlex.join(words)} > one.csv`"
