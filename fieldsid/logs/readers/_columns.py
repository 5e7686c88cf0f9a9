"""Columns of a table by name or index, as numbers and as one clock: shared by the readers of text and Parquet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.cells import as_numbers
from fieldsid.logs.channels import ATTITUDE, ChannelMap, Source
from fieldsid.logs.clocktime import seconds_of
from fieldsid.logs.names import TIME, Canonical, canonical, unit_in_name
from fieldsid.logs.naming import stem_of
from fieldsid.logs.reader import RawLog, ReadOptions, Series
from fieldsid.logs.run import FloatArray, Note
from fieldsid.logs.words import meaning_of
from fieldsid.registry import near


@dataclass(frozen=True, slots=True)
class Columns:
    """The columns of one file; `take` gives the raw cells (n,) of a column by index. Names are empty without a header."""

    path: Path
    names: tuple[str, ...]
    width: int
    take: Callable[[int], npt.NDArray[Any]]

    def index(self, column: str | int, signal: str) -> int:
        """Return the index of a column; raises MappingError naming the near matches."""
        if isinstance(column, int):
            if 0 <= column < self.width:
                return column
            raise MappingError(
                f"`{self.path}` has no column {column} for `{signal}`",
                found=f"{self.width} columns, 0 to {self.width - 1}",
                hint=f"columns are counted from 0: `sysid inspect {quote(str(self.path))}` lists them",
            )
        places = [i for i, name in enumerate(self.names) if name == column]
        if len(places) == 1:
            return places[0]
        if places:
            raise MappingError(
                f"`{self.path}` has {len(places)} columns named `{column}`",
                found=f"columns {places}",
                hint=f"name it by its place in a mapping, as `column: {places[0]}`",
            )
        raise MappingError(
            f"`{self.path}` has no column `{column}` for `{signal}`",
            found=", ".join(self.names) or f"{self.width} columns without names",
            hint=near(column, self.names) if self.names else f"use an index from 0 to {self.width - 1}",
        )

    def name(self, index: int) -> str:
        """Return a column's name, or its index as text."""
        return self.names[index] if self.names else str(index)


def own_map_of(names: Sequence[str]) -> ChannelMap | None:
    """Return the mapping of a table whose columns have canonical names (time among them), or None.

    Where two columns mean one signal, the one in SI is taken.
    """
    stated = [(name, said) for name in names if (said := canonical(name)) is not None]
    best: dict[str, tuple[str, Canonical]] = {}
    for name, said in stated:
        if said.signal not in best or name.strip().lower() == said.signal:
            best[said.signal] = (name, said)
    if TIME not in best or len(best) < 2:
        return None
    sources = {signal: Source(column=name, unit=said.unit) for signal, (name, said) in best.items()}
    return ChannelMap({s: v for s, v in sources.items() if s != TIME}, time=sources[TIME])


def used_by(mapping: ChannelMap, names: Sequence[str], width: int) -> set[int]:
    """Return the indexes of the columns that a mapping names, as far as a table has them."""
    named = [c for s in mapping.sources.values() for c in (s.column, *s.columns)]
    named.append(mapping.time.column if mapping.time else None)
    indexes = {c for c in named if isinstance(c, int) and 0 <= c < width}
    return indexes | {i for i, name in enumerate(names) if name in named}


def series_of(path: Path, columns: Columns, mapping: ChannelMap, notes: tuple[Note, ...], options: ReadOptions) -> RawLog:
    """Return the mapped columns of a table on its time column."""
    time, time_notes = _time(columns, mapping, options)
    bad: list[Note] = []
    series: dict[str, Series] = {}
    for signal, source in mapping.sources.items():
        _check_source(path, signal, source)
        picked = [columns.index(c, signal) for c in (source.columns or (source.column,)) if c is not None]
        numbers = [_numbers(columns, i, signal, bad, options) for i in picked]
        values = numbers[0] if len(numbers) == 1 else np.stack(numbers, axis=1)
        label = ", ".join(columns.name(i) for i in picked)
        unit = None if signal == ATTITUDE else unit_in_name(label, signal)
        series[signal] = Series(time, values, label, unit, label.strip().lower() == "z")
    ignored = _ignored(columns, mapping)
    return RawLog(stem_of(path), series, (*notes, *time_notes, *bad, *ignored))


def _check_source(path: Path, signal: str, source: Source) -> None:
    if source.topic is not None:
        raise MappingError(
            f"`{signal}` is mapped to topic `{source.topic}`, but `{path}` is a table", found=source.label, hint="name a `column`"
        )
    if signal == ATTITUDE and len(source.columns) != 4:
        raise MappingError(
            f"`{ATTITUDE}` needs four columns in a table", found=source.label, hint="write `columns: [qx, qy, qz, qw]`"
        )


def _time(columns: Columns, mapping: ChannelMap, options: ReadOptions) -> tuple[FloatArray, list[Note]]:
    if mapping.time is None or mapping.time.column is None:
        shown = ", ".join(columns.names) or f"{columns.width} columns without names"
        guessed = [name for name in columns.names if (meaning := meaning_of(name)) is not None and meaning[0] == TIME]
        likely = guessed[0] if guessed else "COLUMN" if columns.names else "0"
        # Without a file the mapping came from `--channel`.
        way = f"add `time: {{column: {likely}, unit: s}}` to {mapping.place}" if mapping.origin else ""
        raise MappingError(
            f"`{columns.path}` has no time column: `{TIME}` is missing",
            found=shown,
            hint=way or f"add `--channel {quote(f'time={likely}:s')}`",
        )
    index = columns.index(mapping.time.column, TIME)
    name = columns.name(index)
    unit = mapping.time.unit or unit_in_name(name, TIME)
    return seconds_of(columns.take(index), unit, options, name=name)


def _numbers(columns: Columns, index: int, signal: str, bad: list[Note], options: ReadOptions) -> FloatArray:
    """Return a column as float64 (n,), NaN where a cell is empty."""
    cells = columns.take(index)
    values, wrong = as_numbers(cells)
    if wrong.size:
        first = int(wrong[0])
        if not options.salvage:
            raise LogError(
                f"column `{columns.name(index)}` for `{signal}` holds cells that are no numbers",
                found=f"{wrong.size} of {values.size}, the first in row {first + 1}: {str(cells[first])[:40]!r}",
                hint=options.salvaging("map another column, or take them as missing", 1.0 - wrong.size / values.size)
                or "map another column, or leave the signal out",
            )
        message = f"{signal}: cells that are no numbers and count as missing: {wrong.size}"
        bad.append(Note("not_a_number", message, {"signal": signal, "count": int(wrong.size)}))
    return values


def _ignored(columns: Columns, mapping: ChannelMap) -> list[Note]:
    used = {s.column for s in mapping.sources.values()} | {c for s in mapping.sources.values() for c in s.columns}
    used.add(mapping.time.column if mapping.time else None)
    extra = [name for i, name in enumerate(columns.names) if name not in used and i not in used]
    if not extra:
        return []
    shown = ", ".join(extra[:6]) + (", ..." if len(extra) > 6 else "")
    return [Note("ignored_columns", f"columns that are not used: {shown}", {"columns": extra})]
