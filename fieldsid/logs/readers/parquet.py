"""Read Parquet tables: Runs written by this package, with their notes, and any other table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.reader import MOST_CHANNELS, RawLog, ReadOptions, Series
from fieldsid.logs.readers._columns import Columns, own_map_of
from fieldsid.logs.readers._tables import Table, table_reader
from fieldsid.logs.readers._unpacked import UnpackedSize, refuse_repeated
from fieldsid.logs.run import COLUMNS, Note
from fieldsid.logs.several.run_names import stem_of
from fieldsid.logs.unknown_file import COPY_AGAIN, head_of
from fieldsid.records.check import check
from fieldsid.records.kinds import RUN_HEAD
from fieldsid.records.reading import read_json

MAGIC = b"PAR1"
METADATA_KEY = b"fieldsid"
NUMBER_BYTES = np.dtype(np.float64).itemsize
LIST_CELLS = 3
"""Number of cells that are read of a column of lists."""
AGAIN = "import the log again, with `--force`"


def sniff(path: Path) -> bool:
    """Whether a file has the signature of Parquet."""
    return head_of(path).startswith(MAGIC)


def table(path: Path, form: TableForm, options: ReadOptions, mapping: ChannelMap | None) -> Table:
    """Return the columns of a table of any program; raises LogError where it cannot be read."""
    found = _table(path)
    names = tuple(found.column_names)
    columns = Columns(path, names, len(names), lambda i: _cells(found.column(i)))
    return Table(columns, more=len(_schema_of(path).names) - len(names))


def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the mapped columns; a Run of this package is returned as it was written, unless a mapping file is used."""
    if mapping.origin is None and METADATA_KEY in (_schema_of(path).metadata or {}):
        found = _table(path)
        notes = _notes_of_ours(path, found)
        if notes is not None:
            return RawLog(stem_of(path), _series_of_ours(path, found), notes, finished=True)
    return ANY_TABLE.read(path, mapping, options)


def names_of(path: Path) -> tuple[str, ...]:
    """Return the names of a table's columns, empty for a Run of this package; raises LogError where it cannot be read."""
    schema = _schema_of(path)
    return () if METADATA_KEY in (schema.metadata or {}) else tuple(schema.names)


def _schema_of(path: Path) -> Any:
    try:
        return import_module("pyarrow.parquet").read_schema(path)
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error


def _table(path: Path) -> Any:
    try:
        # read_table refuses a file in which two columns have one name
        with import_module("pyarrow.parquet").ParquetFile(path, read_dictionary=_text_columns(path)) as file:
            refuse_repeated(path, file.metadata.num_rows, path.stat().st_size)
            size = UnpackedSize(path)
            for bytes_of in _stated_sizes(file.metadata):
                size.add(bytes_of)
            table = file.read(columns=_first_columns(file.schema_arrow.names))
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error
    for column in table.columns:
        size.add(_expanded_size(column))
    return table


def _text_columns(path: Path) -> list[str]:
    """Return the names of the columns of text, which are read as dictionaries, because a long text may repeat in every row."""
    kinds, schema = import_module("pyarrow.types"), import_module("pyarrow.parquet").read_schema(path)
    return [f.name for f in schema if kinds.is_string(f.type) or kinds.is_binary(f.type)]


def _stated_sizes(metadata: Any) -> Iterator[int]:
    """Yield the unpacked bytes that each row group states, but at least NUMBER_BYTES for each number, repeated ones included."""
    for i in range(metadata.num_row_groups):
        group = metadata.row_group(i)
        columns = (group.column(j) for j in range(group.num_columns))
        yield sum(max(c.total_uncompressed_size, NUMBER_BYTES * c.num_values) for c in columns)


def _expanded_size(column: Any) -> int:
    """Return the bytes of a column of text with the text written out in each row; zero for any other column."""
    if not import_module("pyarrow.types").is_dictionary(column.type):
        return 0
    compute = import_module("pyarrow.compute")
    lengths = (compute.take(compute.binary_length(c.dictionary), c.indices) for c in column.chunks)
    return sum(compute.sum(n).as_py() or 0 for n in lengths)


def _first_columns(names: list[str]) -> list[str] | None:
    """Return the names of the columns to read of a very wide table; None for all."""
    return names[:MOST_CHANNELS] if len(names) > MOST_CHANNELS else None


def _unreadable(path: Path, error: Exception) -> LogError:
    return LogError(
        f"`{path}` is not a readable Parquet file",
        found=str(error).splitlines()[0][:160],
        hint=COPY_AGAIN,
    )


def _notes_of_ours(path: Path, table: Any) -> tuple[Note, ...] | None:
    """Return the notes of a Run of this package, None for another table; raises LogError where its metadata are damaged."""
    text = (table.schema.metadata or {}).get(METADATA_KEY)
    if not text:
        return None
    try:
        body = read_json(text)
        if not isinstance(body, dict) or not str(body.get("schema", "")).startswith("fieldsid/run/"):
            return None
        check(body, RUN_HEAD)
    except ValueError as error:
        raise LogError(f"`{path}` is a run of ours whose notes are spoilt", found=str(error)[:160], hint=AGAIN) from error
    return tuple(Note(n["code"], n["message"], n["data"]) for n in body["notes"])


def _series_of_ours(path: Path, table: Any) -> dict[str, Series]:
    """Return the signals of a Run of this package; raises LogError where a column is missing, duplicate or not numeric."""
    kept = [n for n in table.column_names if n in COLUMNS or n == TIME]
    numbers = {n: _cells(table.column(i)) for i, n in enumerate(table.column_names) if n in kept}
    wrong = [n for n in (TIME, *kept) if kept.count(n) != 1 or numbers[n].dtype.kind not in "fiub"]
    if not wrong and not (numbers[TIME].size > 1 and bool(np.isfinite(numbers[TIME]).all())):
        raise LogError(f"`{path}` is a run of ours without a time", found=f"{numbers[TIME].size} rows", hint=AGAIN)
    if wrong:
        found = f"`{wrong[0]}` is {'missing' if wrong[0] not in kept else 'twice there, or holds no numbers'}"
        raise LogError(f"`{path}` is a run of ours whose columns are spoilt", found=found, hint=AGAIN)
    return {n: Series(numbers[TIME], v, n) for n, v in numbers.items() if n != TIME}


def _cells(column: Any) -> Any:
    """Return a column's cells (n,): numbers unchanged, times as datetime64, others as text, with None for empty cells."""
    kinds, arrow = import_module("pyarrow.types"), import_module("pyarrow")
    arrow_type = column.type
    if kinds.is_integer(arrow_type) or kinds.is_floating(arrow_type):
        return column.to_numpy()
    if kinds.is_boolean(arrow_type) or kinds.is_decimal(arrow_type) or kinds.is_null(arrow_type):
        return column.cast(arrow.float64()).to_numpy()
    if kinds.is_timestamp(arrow_type) or kinds.is_date(arrow_type):
        return column.cast(arrow.timestamp("ns"), safe=False).to_numpy()
    if kinds.is_duration(arrow_type):
        return column.cast(arrow.duration("ns"), safe=False).cast(arrow.int64()).to_numpy() / 1e9
    shown = len(column) if not kinds.is_nested(arrow_type) else LIST_CELLS  # lists are no signal: a few are read to be shown
    cells = np.full(len(column), None, dtype=object)
    cells[:shown] = [None if cell is None else str(cell) for cell in column.slice(0, shown).to_pylist()]
    return cells


ANY_TABLE = table_reader("parquet", "Parquet table, ours or any other", (".parquet",), "Parquet table", sniff, table, names_of)
READER = replace(ANY_TABLE, read=read, own_map=lambda path, _: own_map_of(_schema_of(path).names))
