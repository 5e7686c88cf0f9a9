"""Read the columns of a table by name or index, as numbers on one time: shared by the readers of tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.channels import ATTITUDE, COMBINED, ChannelMap, Source
from fieldsid.logs.convert.number_cells import as_numbers
from fieldsid.logs.convert.times.time_column import seconds_of, seconds_of_parts
from fieldsid.logs.few_of import FEW, few_of
from fieldsid.logs.mapping.canonical_names import Canonical, canonical, stated_unit, unit_in_name, words_of
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import SAMPLED, RawLog, ReadOptions, Samples, Series
from fieldsid.logs.run import FINS, Note
from fieldsid.logs.several.run_names import stem_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

LOOKED_AT = 200


@dataclass(frozen=True, slots=True)
class Columns:
    """The columns of one file.

    `take` returns the raw cells (n,) of a column by index. `names` is empty without a header, and `units` without a row of units.
    """

    path: Path
    names: tuple[str, ...]
    width: int
    take: Callable[[int], npt.NDArray[Any]]
    units: tuple[str, ...] = ()

    def index(self, column: str | int, signal: str) -> int:
        """Return the index of a column; raises MappingError naming the near matches."""
        places = [i for i, name in enumerate(self.names) if name == column]
        if isinstance(column, int):
            if 0 <= column < self.width:
                return column
            what, found = f"no column {column} for `{signal}`", f"{self.width} columns, 0 to {self.width - 1}"
            hint = f"columns are counted from 0: `sysid inspect {quote(str(self.path))}` lists them"
        elif len(places) == 1:
            return places[0]
        elif places:
            what = f"{len(places)} columns named `{column}`, and which is meant for `{signal}` is open"
            found, hint = f"columns {places}", f"name it by its place in a mapping, as `column: {places[0]}`"
        else:
            what, found = f"no column `{column}` for `{signal}`", self.shown()
            hint = near(column, self.names) if self.names else f"use an index from 0 to {self.width - 1}"
        raise MappingError(f"`{self.path}` has {what}", found=found, hint=hint, signal=signal)

    def shown(self) -> str:
        """Return the names of the columns for a message; where there are many, only the first ones."""
        return few_of(self.names) or f"{self.width} columns without names"

    def name(self, index: int) -> str:
        """Return a column's name, or its index as text."""
        return self.names[index] if self.names else str(index)

    def place(self, index: int) -> str | int:
        """Return the name by which a mapping refers to a column, or its index where the name is not unique."""
        name = self.name(index)
        return name if self.names.count(name) == 1 else index

    def unit(self, index: int, signal: str) -> str | None:
        """Return the unit that a column states for a signal, in its name or in the row of units; None where none fits."""
        return unit_in_name(self.name(index), signal, self.units[index] if self.units else None)

    def rows(self, keep: npt.NDArray[np.bool_]) -> Columns:
        """Return the columns with only those rows for which the mask (n,) is true."""
        return replace(self, take=lambda index: self.take(index)[keep])


def numbers_mostly(cells: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return cells (n,) as numbers, with NaN for words, if FEW are words, of the first ones too; else the cells unchanged."""
    if cells.dtype.kind != "O":
        return cells
    seen = [c for c in cells[:LOOKED_AT].tolist() if isinstance(c, str)]
    if as_numbers(np.array(seen, dtype=object))[1].size > FEW * len(seen):
        return cells
    values, wrong = as_numbers(cells)
    return values if wrong.size <= FEW * cells.size else cells


def samples_of(columns: Columns, time: FloatArray, source: Source) -> Samples:
    """Return the numeric columns of a table, decimated to at most SAMPLED rows."""
    step, seen = max(1, -(-time.size // SAMPLED)), np.isfinite(time)
    taken = {}
    for i in range(columns.width):
        cells = numbers_mostly(columns.take(i))
        if cells.dtype.kind in "fiub":
            taken[columns.place(i)] = cells[seen][::step].astype(np.float64)
    return Samples(time[seen][::step], taken, source)


def own_map_of(names: Sequence[str]) -> ChannelMap | None:
    """Return the mapping of a table whose columns have canonical names (time among them), or None."""
    sources = canonical_sources(names)
    if TIME not in sources or len(sources) < 2:
        return None
    return ChannelMap({s: v for s, v in sources.items() if s != TIME}, time=sources[TIME])


def canonical_sources(names: Sequence[str]) -> dict[str, Source]:
    """Return the columns of a table that have canonical names, by signal, including the time.

    Where two columns mean one signal, the one in SI is taken.
    """
    matches = [(name, match) for name in names if (match := canonical(name)) is not None]
    best: dict[str, tuple[str, Canonical]] = {}
    for name, match in matches:
        if match.signal not in best or name.strip().lower() == match.signal:
            best[match.signal] = (name, match)
    return {signal: Source(column=name, unit=match.unit) for signal, (name, match) in best.items()}


def used_by(mapping: ChannelMap, names: Sequence[str], width: int) -> set[int]:
    """Return the indexes of those columns of a table that a mapping names."""
    named = [c for s in (*mapping.sources.values(), *([mapping.time] if mapping.time else [])) for c in s.places]
    indexes = {c for c in named if isinstance(c, int) and 0 <= c < width}
    return indexes | {i for i, name in enumerate(names) if name in named}


def series_of(path: Path, columns: Columns, mapping: ChannelMap, notes: tuple[Note, ...], options: ReadOptions) -> RawLog:
    """Return the signals of a table that are mapped, at the times of its time column."""
    columns, blank = _without_blank_rows(columns, mapping)
    notes = (*notes, *blank)
    time, time_notes = _time(columns, mapping, options)
    bad: list[Note] = []
    series: dict[str, Series] = {}
    for signal, source in mapping.sources.items():
        _check_source(path, signal, source)
        picked = [columns.index(c, signal) for c in (source.columns or (source.column,)) if c is not None]
        numbers = [_numbers(columns, i, signal, bad, options) for i in picked]
        values = numbers[0] if len(numbers) == 1 else np.stack(numbers, axis=1)
        label = ", ".join(columns.name(i) for i in picked)
        unit = None if signal in COMBINED else columns.unit(picked[0], signal)
        bad += _other_unit_below(columns, picked[0], signal, source.unit or unit) if mapping.origin is None else []
        series[signal] = Series(time, values, label, unit, label.strip().lower() == "z")
    bad += _other_fins(columns, mapping) if mapping == own_map_of(columns.names) else []
    ignored = _ignored(columns, mapping)
    return RawLog(stem_of(path), series, (*notes, *time_notes, *bad, *ignored))


def _other_unit_below(columns: Columns, index: int, signal: str, unit: str | None) -> list[Note]:
    """Return the note that the row of units states another unit than the one in which a column is read."""
    below = stated_unit(columns.units[index], signal) if columns.units else None
    if below is None or unit is None or below == unit:
        return []
    message = f"{signal} is taken in {unit}, and the row of units says {below}: set its unit, `unit: {below}` where that is right"
    return [Note("unit", message, {"signal": signal, "unit": below})]


def _other_fins(columns: Columns, mapping: ChannelMap) -> list[Note]:
    """Return a note for each fin that a column which is not used also means by its name."""
    used, others = used_by(mapping, columns.names, columns.width), dict[str, list[str]]()
    for name in (name for i, name in enumerate(columns.names) if i not in used):
        meaning = meaning_of(name)
        if meaning is not None and meaning[0] in FINS and meaning[0] in mapping.sources:
            others.setdefault(meaning[0], []).append(f"`{name}`")
    return [
        Note(
            "alternatives",
            f"{fin} is taken from `{mapping.sources[fin].column}`; it may also be {few_of(names)}: map the command",
            {"signal": fin, "others": names},
        )
        for fin, names in others.items()
    ]


def _check_source(path: Path, signal: str, source: Source) -> None:
    if source.topic is not None:
        raise MappingError(
            f"`{signal}` is mapped to topic `{source.topic}`, but `{path}` is a table",
            found=source.label,
            hint="name a `column`; or, of a run in several tables, give their folder, or all of them with --join",
            signal=signal,
        )
    if signal == ATTITUDE and len(source.columns) != 4:
        raise MappingError(
            f"`{ATTITUDE}` needs four columns in a table", found=source.label, hint="write `columns: [qx, qy, qz, qw]`"
        )


NO_CLOCK = "where no column is a time write how many rows there are a second at the top of the mapping, as `time: {rate: 10}`"
COUNTERS = frozenset(
    {"sample", "samples", "index", "idx", "row", "frame", "no", "nr", "number", "count", "counter", "seq", "step", "entry"}
)
"""Words in the name of a column that counts the rows of a table."""


def is_counter(name: str) -> bool:
    """Whether a column counts rows, by its name, so that it gives their order but no time."""
    words = set(words_of(name))
    return bool(words) and words <= COUNTERS


def _time(columns: Columns, mapping: ChannelMap, options: ReadOptions) -> tuple[FloatArray, list[Note]]:
    if mapping.time is None or not (mapping.time.places or mapping.time.counts_rows):
        guessed = [name for name in columns.names if (meaning := meaning_of(name)) is not None and meaning[0] == TIME]
        # Without a file the mapping came from `--channel`.
        hint = f"add `time: {{column: {guessed[0]}, unit: s}}` to {mapping.place}" if mapping.origin and guessed else ""
        counter = None if guessed else next((name for name in columns.names if is_counter(name)), None)
        if counter is not None:
            hint = f"`{counter}` counts samples: write how many there are a second at the top of the mapping, as "
            hint += f"`time: {{column: {counter}, rate: 10}}`"
        raise MappingError(
            f"`{columns.path}` has no time column: `{TIME}` is missing",
            found=columns.shown(),
            hint=hint or (f"add `--channel {quote(f'time={guessed[0]}:s')}`" if guessed else NO_CLOCK),
        )
    read = min(used_by(mapping, columns.names, columns.width), default=0)
    return time_of(columns, mapping.time, mapping.time.unit, options, counted=read)


def time_of(
    columns: Columns, source: Source, unit: str | None, options: ReadOptions, counted: int = 0
) -> tuple[FloatArray, list[Note]]:
    """Return the time (n,) in s of the rows of a table, from one column or as the sum of several, and notes.

    A time without a column counts the rows, which are those of the column `counted`. Raises LogError and MappingError, see
    seconds_of.
    """
    if source.counts_rows:
        return (source.scale or 1.0) * np.arange(columns.take(counted).size, dtype=np.float64), []
    dated = [columns.index(c, TIME) for c in source.date]
    dates = [columns.take(i) for i in dated]
    if source.columns:
        places = [columns.index(c, TIME) for c in source.columns]
        names, date_names = [columns.name(i) for i in places], [columns.name(i) for i in dated]
        parts = [columns.take(i) for i in places]
        return seconds_of_parts(parts, unit, options, names=names, dates=dates, date_names=date_names)
    index = columns.index(source.column if source.column is not None else 0, TIME)
    weeks = None if source.week is None else columns.take(columns.index(source.week, TIME))
    unit = unit or columns.unit(index, TIME)
    time, notes = seconds_of(columns.take(index), unit, options, name=columns.name(index), dates=dates, weeks=weeks)
    return time if source.scale is None else time * source.scale, notes


def _without_blank_rows(columns: Columns, mapping: ChannelMap) -> tuple[Columns, list[Note]]:
    """Return the columns without the rows that have neither a time nor a mapped number, and a note on words in such rows.

    Such rows are a last line of separators alone, and lines of text between the rows of data.
    """
    if mapping.time is None or not mapping.time.places:
        return columns, []
    place = columns.index(mapping.time.places[0], TIME)
    times = columns.take(place)
    rows = _without_value(times)
    if not rows.any():
        return columns, []
    for i in used_by(mapping, columns.names, columns.width) - {place}:
        rows &= _without_value(columns.take(i))
    if not rows.any() or rows.all():
        return columns, []
    words = times[rows][~_is_missing(times[rows])]
    first = str(words[0])[:60] if words.size else ""
    message = f"lines of words between the rows, left out: {words.size}, the first {first!r}"
    return columns.rows(~rows), [Note("text_rows", message, {"count": int(words.size)})] if words.size else []


def _is_missing(cells: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    import pandas as pd

    return np.asarray(pd.isna(cells))


def _without_value(cells: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return a mask (n,) of the cells that are empty or words."""
    return _is_missing(cells) | (_is_word(cells) if cells.dtype.kind == "O" else False)


def _is_word(cells: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return a mask (n,) of the cells with a letter and without a leading digit, which are no number, clock or date."""
    return np.array([isinstance(c, str) and not c.strip()[:1].isdigit() and any(x.isalpha() for x in c) for c in cells])


def _numbers(columns: Columns, index: int, signal: str, bad: list[Note], options: ReadOptions) -> FloatArray:
    """Return a column as float64 (n,), NaN where a cell is empty; append to `bad` the note on cells that are no numbers.

    Raises LogError for such a cell unless the options say to salvage.
    """
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
                signal=signal,
            )
        message = f"{signal}: cells that are no numbers and count as missing: {wrong.size}"
        bad.append(Note("not_a_number", message, {"signal": signal, "count": int(wrong.size)}))
    return values


def _ignored(columns: Columns, mapping: ChannelMap) -> list[Note]:
    used = used_by(mapping, columns.names, columns.width)
    extra = [name for i, name in enumerate(columns.names) if i not in used]
    if not extra:
        return []
    return [Note("ignored_columns", f"columns that are not used: {few_of(extra)}", {"columns": extra})]
