"""Parquet tables: our own Runs, with their notes, and anybody's columns."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from typing import Any

from fieldsid.errors import LogError
from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.mapping.canonical_names import TIME
from fieldsid.logs.reader import ChannelInfo, FieldInfo, Inventory, RawLog, Reader, ReadOptions, Series
from fieldsid.logs.readers._clock import clock_of
from fieldsid.logs.readers._columns import Columns, own_map_of, samples_of, series_of
from fieldsid.logs.run import SIGNALS, Note
from fieldsid.logs.several.run_names import stem_of
from fieldsid.logs.unknown_file import COPY_AGAIN

MAGIC = b"PAR1"
METADATA_KEY = b"fieldsid"


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
    for name in table.column_names:
        column = table.column(name)
        count = len(column) - column.null_count
        kind = "number" if _is_number(column) else "text"
        rate = clock.rate_hz(column.to_numpy()) if clock else float("nan")
        channels.append(ChannelInfo(name, kind, count, rate, (FieldInfo("", kind, tuple(column[:3].to_pylist())),)))
    samples = samples_of(columns, clock.time, clock.source) if clock else None
    return Inventory(path, "Parquet table", clock.duration_s if clock else float("nan"), tuple(channels), samples=samples)


def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the mapped columns, or one of our Runs as it was written."""
    table = _table(path)
    ours = _ours(table)
    if ours is not None and mapping.origin is None:
        time = _cells(table, TIME)
        series = {n: Series(time, _cells(table, n), n) for n in table.column_names if n in SIGNALS}
        notes = tuple(Note(n["code"], n["message"], n["data"]) for n in ours["notes"])
        return RawLog(stem_of(path), series, notes, finished=True)
    return series_of(path, _columns(path, table), mapping, (), options)


def own_map(path: Path, options: ReadOptions) -> ChannelMap | None:
    """Return the mapping of a table with canonical names, or None."""
    try:
        return own_map_of(import_module("pyarrow.parquet").read_schema(path).names)
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error


def _columns(path: Path, table: Any) -> Columns:
    names = tuple(table.column_names)
    return Columns(path, names, len(names), lambda i: _cells(table, names[i]))


def _table(path: Path) -> Any:
    try:
        return import_module("pyarrow.parquet").read_table(path)
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> LogError:
    return LogError(
        f"`{path}` is not a readable Parquet file",
        found=str(error).splitlines()[0][:160],
        hint=COPY_AGAIN,
    )


def _ours(table: Any) -> Any:
    """Return what we wrote beside the columns, or None for somebody else's table."""
    text = (table.schema.metadata or {}).get(METADATA_KEY)
    body = json.loads(text) if text else None
    return body if isinstance(body, dict) and str(body.get("schema", "")).startswith("fieldsid/run/") else None


def _is_number(column: Any) -> bool:
    kinds = import_module("pyarrow.types")
    return bool(kinds.is_integer(column.type) or kinds.is_floating(column.type) or kinds.is_boolean(column.type))


def _cells(table: Any, name: str) -> Any:
    return table.column(name).to_numpy()


READER = Reader(
    name="parquet",
    says="Parquet table, ours or any other",
    suffixes=(".parquet",),
    sniff=sniff,
    inventory=inventory,
    read=read,
    own_map=own_map,
)
