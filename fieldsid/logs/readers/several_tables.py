"""Read a run in several tables of one clock, each with its own stamps: a table is a topic, and its columns are the fields.

Exports of a message log (Neptus, ulog2csv, `rostopic echo -p`) and simulators with a separate table of inputs write such runs.
The tables are joined like the topics of any other log.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.channels import ATTITUDE, ChannelMap, TableForm, is_enough
from fieldsid.logs.convert.times.clock_text import FEW_STEPS
from fieldsid.logs.convert.times.time_column import EPOCH_FROM_S
from fieldsid.logs.few_of import MOSTLY, few_of
from fieldsid.logs.mapping.canonical_names import words_of
from fieldsid.logs.mapping.guesses import quaternion_of
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.reader import JOINED, MOST_DEVICES, TABLE, Inventory, RawLog, Reader, ReadOptions, reader_of
from fieldsid.logs.readers._clock import Clock, clock_of
from fieldsid.logs.readers._columns import Columns, canonical_sources, numbers_mostly
from fieldsid.logs.readers._tables_of_run import names_in_run, run_of, runs_in
from fieldsid.logs.readers._topics import Means, Topic, Topics, inventory_of, raw_log_of, topic_of, wanted_by
from fieldsid.logs.run import Note
from fieldsid.logs.several.run_names import name_of_run
from fieldsid.numerics.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Part:
    """One table of a run, or one device of a table: its file, its numbers at the logger's times, and their origin in words."""

    file: Path
    topic: Topic
    counts_from: str

    @property
    def span(self) -> tuple[float, float]:
        """Return the first and the last time in s."""
        return float(self.topic.time[0]), float(self.topic.time[-1])


def sniff(path: Path) -> bool:
    """Whether a folder has tables that must be joined to one run or to several runs."""
    return path.is_dir() and bool(runs_in(path))


def holds_one_run(path: Path) -> bool:
    """Whether a folder has tables that must be joined, all of one run; raises LogError where one cannot be read."""
    return len(runs_in(path)) == 1


def inventory(path: Path, options: ReadOptions, form: TableForm) -> Inventory:
    """Return the tables and their columns; raises LogError where the folder has several runs."""
    parts, notes = _parts(path, options, form, ChannelMap({}, time=options.clock))
    topics = {name: part.topic for name, part in parts.items()}
    apart = _reason_not_to_join(parts)
    notes = (*notes, *([Note("clocks_apart", f"{apart.what} ({apart.found})", {})] if apart else _notes_of_joining(parts)))
    return inventory_of(path, "tables of one run", Topics(topics, _attitudes(topics), notes), kind=TABLE)


def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the mapped columns; raises MappingError for one that is not there, LogError where their clocks are not one."""
    wanted = wanted_by(mapping)
    parts, notes = _parts(path, options, mapping.table, mapping, wanted)
    used = {name: part for name, part in parts.items() if name in wanted}
    apart = _reason_not_to_join(used)
    if apart is not None:
        raise apart
    topics = {name: part.topic for name, part in parts.items()}
    raw = raw_log_of(path, Topics(topics, notes=(*notes, *_notes_of_joining(used))), mapping)
    return replace(raw, name=name_of_run(run_of(path, options.joined)) if options.joined else raw.name)


def own_map(path: Path, options: ReadOptions) -> ChannelMap | None:
    """Return the mapping of tables whose canonical names include what an axis needs, each signal in one table only; else None."""
    parts, _ = _parts(path, options, TableForm(), ChannelMap({}))
    named = [
        (signal, replace(source, column=None, topic=topic, path=str(source.column)))
        for topic, part in parts.items()
        for signal, source in canonical_sources([*map(str, part.topic.fields)]).items()
        if signal != TIME
    ]
    sources = dict(named)
    return ChannelMap(sources) if is_enough(sources) and len(sources) == len(named) else None


def _parts(
    path: Path, options: ReadOptions, form: TableForm, mapping: ChannelMap, wanted: Collection[str] = ()
) -> tuple[dict[str, Part], tuple[Note, ...]]:
    """Return the parts of a run by name, from the tables that are wanted (all if none is), and notes on the tables."""
    tables = names_in_run(run_of(path, options.joined))
    bare = {name.partition("[")[0] for name in wanted}
    chosen = {n: p for n, p in tables.items() if n in wanted or n.partition("[")[0] in bare} or tables
    parts: dict[str, Part] = {}
    notes: list[Note] = []
    without: list[str] = []
    for i, (name, file) in enumerate(chosen.items()):
        found, table_notes = _parts_of_table(name, file, options, form, mapping)
        parts |= found
        notes += table_notes
        without += [] if found else [file.name]
        options.progress((i + 1) / len(chosen))
    message = f"tables without a clock that is known, left out: {few_of(without)}"
    return parts, (*notes, *([Note("no_clock", message, {"tables": without})] if without else []))


def _parts_of_table(
    name: str, file: Path, options: ReadOptions, form: TableForm, mapping: ChannelMap
) -> tuple[dict[str, Part], list[Note]]:
    """Return the parts of one table, and notes with its name; raises LogError for a file that is no table."""
    reader = reader_of(file)
    if reader.table is None:
        raise LogError(
            f"`{file}` is no table, and only tables are joined", found=reader.says, hint="import it by itself, as it is"
        )
    table = reader.table(file, form, replace(options, progress=lambda _: None), None)
    found = {}
    for device, rows in devices_of(table.columns).items():
        known = mapping.time if mapping.time is not None and set(mapping.time.places) <= {*rows.names} else None
        clock = clock_of(rows, known)
        topic = None if clock is None else topic_of(clock.time + clock.origin_s, _numbers(rows, clock))
        if clock is not None and topic is not None and topic.time.size > 1 and topic.fields:
            found[name + device] = Part(file, topic, _counts_from(clock))
    return found, [replace(note, message=f"{file.name}: {note.message}") for note in table.notes]


def _numbers(columns: Columns, clock: Clock) -> dict[str, FloatArray]:
    """Return the numeric columns (n,) of a table by name and stated unit, without those of the clock."""
    taken: dict[str, FloatArray] = {}
    for i in range(columns.width):
        cells: Any = numbers_mostly(columns.take(i))
        name = columns.name(i).strip() or str(i)
        if columns.place(i) in clock.source.places or (columns.names and not columns.names[i]) or cells.dtype.kind not in "fiub":
            continue
        unit = columns.units[i].strip() if columns.units else ""
        taken[f"{name} ({unit})" if unit else name] = cells.astype(np.float64)
    return taken


def _counts_from(clock: Clock) -> str:
    if clock.origin_s > EPOCH_FROM_S:
        return "an epoch"
    return "midnight" if clock.origin_s else "a start of its own"


def _attitudes(topics: Mapping[str, Topic]) -> Means:
    """Return the meaning of the four columns that are a quaternion, for each table that has them."""
    columns: dict[str, dict[str | int, FloatArray]] = {name: dict(topic.fields.items()) for name, topic in topics.items()}
    found = {name: quaternion_of(list(topics[name].fields), fields) for name, fields in columns.items()}
    return {
        f"{name.partition('[')[0]}.{', '.join(four['columns'])}": (ATTITUDE, {k: v for k, v in four.items() if k != "columns"})
        for name, four in found.items()
        if four
    }


def _reason_not_to_join(parts: Mapping[str, Part]) -> LogError | None:
    """Return the error for tables that cannot be joined, because their clocks have different origins or no time in common.

    None where they can be joined.
    """
    kinds = {part.counts_from: part for part in parts.values()}
    if len(kinds) > 1:
        origins = "; ".join(f"`{part.file.name}` from {start}" for start, part in kinds.items())
        return LogError(
            "the tables are on different clocks, and are not joined",
            found=f"they count: {origins}",
            hint="export them with one clock, or write the start of the one into the other's times",
        )
    if not parts:
        return None
    latest = max(parts.values(), key=lambda part: part.span[0])
    first = min(parts.values(), key=lambda part: part.span[1])
    if latest.span[0] < first.span[1]:
        return None
    return LogError(
        "the tables were never logged at the same time, and are not joined",
        found=f"`{first.file.name}` ends at {first.span[1]:.3f} s, `{latest.file.name}` starts at {latest.span[0]:.3f} s",
        hint="they are several runs: name those that belong together, with --join",
    )


def _notes_of_joining(parts: Mapping[str, Part]) -> list[Note]:
    """Return the notes on which tables were joined, and on clocks that were only assumed to be one."""
    files = list(dict.fromkeys(part.file.name for part in parts.values()))
    if len(files) < 2:
        return []
    low, high = max(p.span[0] for p in parts.values()), min(p.span[1] for p in parts.values())
    start = next(iter(parts.values())).counts_from
    message = f"tables of one run, joined by time: {', '.join(files)}; all count from {start}, and share {high - low:.2f} s"
    notes = [Note("joined", message, {"tables": files})]
    step = max(float(np.median(np.diff(p.topic.time))) for p in parts.values())
    ends = [p.span for p in parts.values()]
    off = max(float(np.ptp([e[k] for e in ends])) for k in (0, 1))
    if start == "a start of its own" and off > FEW_STEPS * step:
        message = f"the tables begin or end {off:.2f} s apart, and count from a start of their own: check that it is one clock"
        notes.append(Note("clock_assumed", message, {"seconds": off}))
    return notes


READER = Reader(
    name=JOINED,
    says="a run in several tables of one clock: a folder of them, or `--join`",
    suffixes=(),
    sniff=sniff,
    inventory=inventory,
    read=read,
    own_map=own_map,
)


DEVICE_WORDS = frozenset({
    "id", "device", "instance", "servo", "channel", "fin", "motor", "actuator", "thruster",
    "number", "no", "nr",
})  # fmt: skip
"""Words in the name of a column that identifies the device."""


def devices_of(columns: Columns) -> dict[str, Columns]:
    """Return the rows of each device by its number or name in brackets, such as `[3]`; without devices, the table by ""."""
    for i, name in enumerate(columns.names):
        words = set(words_of(name))
        if not words or not words <= DEVICE_WORDS:
            continue
        cells = columns.take(i)
        by_device = _rows_by_device(cells)
        if by_device:
            rest = replace(columns, names=tuple(n if k != i else "" for k, n in enumerate(columns.names)))
            return {f"[{label}]": rest.rows(rows) for label, rows in by_device.items()}
    return {"": columns}


def _rows_by_device(cells: npt.NDArray[Any]) -> dict[str, npt.NDArray[np.bool_]]:
    """Return a mask (n,) of the rows of each device named in cells (n,), which alternate mostly; empty where they name none."""
    if cells.size < 2 or float(np.mean(cells[1:] != cells[:-1])) < MOSTLY:
        return {}
    if cells.dtype.kind == "f" and not bool((cells == np.round(cells)).all()):
        return {}
    known = sorted(set(cells.tolist()), key=str) if cells.dtype.kind in "iufO" else []
    if not 1 < len(known) <= MOST_DEVICES:
        return {}
    return {(f"{k:.0f}" if isinstance(k, (int, float)) else str(k).strip()): cells == k for k in known}
