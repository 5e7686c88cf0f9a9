"""Parquet tables: our own Runs, with their notes, and anybody's columns."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.reader import ChannelInfo, FieldInfo, Inventory, RawLog, Reader, ReadOptions, Series, span_of
from fieldsid.logs.readers._clock import clock_of, why_no_clock
from fieldsid.logs.readers._columns import Columns, own_map_of, samples_of, series_of
from fieldsid.logs.readers._unpacked_rows import refuse_repeated
from fieldsid.logs.run import SIGNALS, Note
from fieldsid.logs.several.run_names import stem_of
from fieldsid.logs.unknown_file import COPY_AGAIN

MAGIC = b"PAR1"
METADATA_KEY = b"fieldsid"
AGAIN = "import the log again, with `--force`"


def sniff(path: Path) -> bool:
    """Whether a file starts like Parquet."""
    if path.is_dir():
        return False
    with path.open("rb") as stream:
        return stream.read(4) == MAGIC


def inventory(path: Path, options: ReadOptions, form: TableForm) -> Inventory:
    """Return the columns with their count of numbers and first values."""
    table = _table(path)
    columns = _columns(path, table)
    clock = clock_of(columns, options.clock)
    channels = []
    for i, name in enumerate(table.column_names):
        column, cells = table.column(i), columns.take(i)
        count = len(column) - column.null_count
        kind = "text" if cells.dtype.kind == "O" else "number"
        rate = clock.rate_hz(cells) if clock else float("nan")
        first = cells[:3].astype(str) if cells.dtype.kind == "M" else cells[:3]
        channels.append(ChannelInfo(name, kind, count, rate, (FieldInfo("", kind, tuple(first.tolist()), span_of(cells)),)))
    samples = samples_of(columns, clock.time, clock.source) if clock else None
    problem = why_no_clock(columns) if clock is None and options.clock is None else None
    duration, notes = (clock.duration_s, clock.notes) if clock else (float("nan"), ())
    return Inventory(path, "Parquet table", duration, tuple(channels), notes=notes, samples=samples, no_clock=problem)


def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the mapped columns, or one of our Runs as it was written."""
    table = _table(path)
    notes = _notes_of_ours(path, table)
    if notes is not None and mapping.origin is None:
        return RawLog(stem_of(path), _series_of_ours(path, table), notes, finished=True)
    return series_of(path, _columns(path, table), mapping, (), options)


def own_map(path: Path, options: ReadOptions) -> ChannelMap | None:
    """Return the mapping of a table with canonical names, or None."""
    try:
        return own_map_of(import_module("pyarrow.parquet").read_schema(path).names)
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error


def _columns(path: Path, table: Any) -> Columns:
    names = tuple(table.column_names)
    return Columns(path, names, len(names), lambda i: _cells(table.column(i)))


def _table(path: Path) -> Any:
    try:
        # read_table refuses a file in which two columns have one name
        with import_module("pyarrow.parquet").ParquetFile(path) as file:
            refuse_repeated(path, file.metadata.num_rows, path.stat().st_size)
            return file.read()
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> LogError:
    return LogError(
        f"`{path}` is not a readable Parquet file",
        found=str(error).splitlines()[0][:160],
        hint=COPY_AGAIN,
    )


def _notes_of_ours(path: Path, table: Any) -> tuple[Note, ...] | None:
    """Return the notes we wrote beside the columns, None for somebody else's table; raises LogError where they are spoilt."""
    text = (table.schema.metadata or {}).get(METADATA_KEY)
    if not text:
        return None
    try:
        body = json.loads(text)
        if not str(body["schema"]).startswith("fieldsid/run/"):
            return None
        return tuple(Note(str(n["code"]), str(n["message"]), dict(n["data"])) for n in body["notes"])
    except (ValueError, TypeError, LookupError) as error:
        raise LogError(
            f"`{path}` is a run of ours whose notes are spoilt", found=f"{type(error).__name__}: {error}"[:160], hint=AGAIN
        ) from error


def _series_of_ours(path: Path, table: Any) -> dict[str, Series]:
    """Return the signals of a run of ours on its time; raises LogError where a column is missing, twice there or no numbers."""
    kept = [n for n in table.column_names if n in SIGNALS or n == TIME]
    numbers = {n: _cells(table.column(i)) for i, n in enumerate(table.column_names) if n in kept}
    wrong = [n for n in (TIME, *kept) if kept.count(n) != 1 or numbers[n].dtype.kind not in "fiub"]
    if not wrong and not (numbers[TIME].size > 1 and bool(np.isfinite(numbers[TIME]).all())):
        raise LogError(f"`{path}` is a run of ours without a time", found=f"{numbers[TIME].size} rows", hint=AGAIN)
    if wrong:
        found = f"`{wrong[0]}` is {'missing' if wrong[0] not in kept else 'twice there, or holds no numbers'}"
        raise LogError(f"`{path}` is a run of ours whose columns are spoilt", found=found, hint=AGAIN)
    return {n: Series(numbers[TIME], v, n) for n, v in numbers.items() if n != TIME}


def _cells(column: Any) -> Any:
    """Return a column's cells (n,): numbers as they are, instants as datetime64, all else as text with None where it is empty."""
    kinds, arrow = import_module("pyarrow.types"), import_module("pyarrow")
    held = column.type
    if kinds.is_integer(held) or kinds.is_floating(held):
        return column.to_numpy()
    if kinds.is_boolean(held) or kinds.is_decimal(held) or kinds.is_null(held):
        return column.cast(arrow.float64()).to_numpy()
    if kinds.is_timestamp(held) or kinds.is_date(held):
        return column.cast(arrow.timestamp("ns"), safe=False).to_numpy()
    if kinds.is_duration(held):
        return column.cast(arrow.duration("ns"), safe=False).cast(arrow.int64()).to_numpy() / 1e9
    return np.array([None if cell is None else str(cell) for cell in column.to_pylist()], dtype=object)


READER = Reader(
    name="parquet",
    says="Parquet table, ours or any other",
    suffixes=(".parquet",),
    sniff=sniff,
    inventory=inventory,
    read=read,
    own_map=own_map,
)
