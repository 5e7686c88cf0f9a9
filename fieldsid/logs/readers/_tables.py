"""Make the reader of a format of tables, and the inventory of a table: shared by the readers of several formats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.reader import ChannelInfo, FieldInfo, Inventory, RawLog, Reader, ReadOptions, span_of
from fieldsid.logs.readers._clock import Clock, clock_of, why_no_clock
from fieldsid.logs.readers._columns import Columns, numbers_mostly, own_map_of, samples_of, series_of
from fieldsid.logs.run import Note


@dataclass(frozen=True, slots=True)
class Table:
    """The columns of one file, the format of a text table, notes, and the number of columns that were not read."""

    columns: Columns
    form: TableForm | None = None
    notes: tuple[Note, ...] = ()
    more: int = 0


def table_reader(
    name: str,
    says: str,
    suffixes: tuple[str, ...],
    form: str,
    sniff: Callable[[Path], bool],
    table: Callable[[Path, TableForm, ReadOptions, ChannelMap | None], Table],
    names_of: Callable[[Path], tuple[str, ...]],
) -> Reader:
    """Return the reader of a format of tables.

    `table` reads the columns of a file that a mapping names, or all without a mapping; `names_of` only their names. The reader's
    inventory has each column with its count of numbers, rate, first values and range. It reads the mapped columns, and raises
    MappingError for one that is missing, and LogError for cells that are no numbers, in addition to what `table` raises.
    """

    def inventory(path: Path, options: ReadOptions, written: TableForm) -> Inventory:
        return _inventory(path, form, table(path, written, options, None), options)

    def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
        found = table(path, mapping.table, options, mapping)
        return series_of(path, found.columns, mapping, found.notes, options)

    def own_map(path: Path, options: ReadOptions) -> ChannelMap | None:
        return own_map_of(names_of(path))

    return Reader(name, says, suffixes, sniff, inventory, read, own_map, names_of, table)


def _inventory(path: Path, form: str, table: Table, options: ReadOptions) -> Inventory:
    columns, clock = table.columns, clock_of(table.columns, options.clock)
    return Inventory(
        path,
        form,
        clock.duration_s if clock else float("nan"),
        tuple(_channel(columns, i, clock) for i in range(columns.width)),
        table.form,
        (*table.notes, *(clock.notes if clock else ())),
        samples_of(columns, clock.time, clock.source) if clock else None,
        no_clock=why_no_clock(columns) if clock is None and options.clock is None else None,
        more=table.more,
    )


def _channel(columns: Columns, index: int, clock: Clock | None) -> ChannelInfo:
    import pandas as pd

    values = numbers_mostly(columns.take(index))
    kind = "number" if values.dtype.kind in "fiubM" else "text"
    there = np.isfinite(values) if values.dtype.kind in "fiub" else ~np.asarray(pd.isna(values))
    first = values[there][:3]
    shown: list[Any] = (first.astype(str) if values.dtype.kind == "M" else first).tolist()
    rate = clock.rate_hz(values) if clock else float("nan")
    field = FieldInfo("", kind, tuple(shown), span_of(values))
    return ChannelInfo(
        columns.name(index), kind, int(there.sum()), rate, (field,), columns.units[index] if columns.units else None
    )
