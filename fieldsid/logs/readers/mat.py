"""Read MATLAB files, .mat: columns of equal length among the variables and the fields of structs; version 7.3 by h5py."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers._columns import Columns
from fieldsid.logs.readers._mat_elements import arrays_of
from fieldsid.logs.readers._tables import Table, table_reader
from fieldsid.logs.readers._topics import library
from fieldsid.logs.readers._unpacked import UnpackedSize
from fieldsid.logs.unknown_file import head_of, unreadable
from fieldsid.numerics.arrays import FloatArray

MAGIC = b"MATLAB "
HDF5 = b"MATLAB 7.3"
SHORTEST = 3
WIDEST = 64
_FAILURES = (ValueError, TypeError, KeyError, IndexError, OSError, EOFError, NotImplementedError, OverflowError, MemoryError)


def sniff(path: Path) -> bool:
    """Whether a file has the head that MATLAB writes."""
    return head_of(path).startswith(MAGIC)


def _columns(path: Path) -> Columns:
    found = dict(_of_hdf5(path) if head_of(path).startswith(HDF5) else _of_mat(path))
    lengths = Counter(v.size for v in found.values())
    if not lengths:
        raise LogError(
            f"`{path}` holds no columns of numbers",
            found="no variable or field of a struct with a row for each sample; `table` and `timeseries` are objects",
            hint="save its columns: `save('log.mat', '-struct', 's')`, with `s = table2struct(T, 'ToScalar', true)`",
        )
    longest = max(lengths, key=lambda size: (lengths[size], size))
    kept = {name: v for name, v in found.items() if v.size == longest}
    names, filled = tuple(kept), _filled_rows(list(kept.values()))
    return Columns(path, names, len(names), lambda i: kept[names[i]][:filled])


def _filled_rows(columns: list[FloatArray]) -> int:
    """Return the number of rows up to the last one that is not all zero: preallocated rows that were not filled are zero."""
    nonzero = np.flatnonzero(np.logical_or.reduce([v != 0.0 for v in columns]))
    return int(nonzero[-1]) + 1 if nonzero.size else columns[0].size


def _of_mat(path: Path) -> Iterator[tuple[str, FloatArray]]:
    for name, array in arrays_of(path):
        if name:  # the workspace of function handles has none
            yield from _of_array(name, np.squeeze(array))


def _of_array(name: str, value: Any) -> Iterator[tuple[str, FloatArray]]:
    if value.ndim == 1 and value.size >= SHORTEST:
        yield name, value.astype(np.float64)
    elif value.ndim == 2 and min(value.shape) <= WIDEST and max(value.shape) >= SHORTEST:
        rows = value if value.shape[0] >= value.shape[1] else value.T
        for i in range(rows.shape[1]):
            yield f"{name}({i + 1})", rows[:, i].astype(np.float64)


def _of_hdf5(path: Path) -> Iterator[tuple[str, FloatArray]]:
    h5py = library("h5py", path, "a MATLAB 7.3 file", "matlab")
    found: list[tuple[str, FloatArray]] = []
    size = UnpackedSize(path)

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and not name.startswith("#"):
            size.add(item.size * item.dtype.itemsize)
            found.extend(_of_array(name.rpartition("/")[2], np.squeeze(np.asarray(item))))

    try:
        with h5py.File(str(path), "r") as file:
            file.visititems(visit)
    except _FAILURES as error:
        raise unreadable(path, "a MATLAB file that cannot be read", error) from error
    yield from found


def table(path: Path, form: TableForm, options: ReadOptions, mapping: ChannelMap | None) -> Table:
    """Return the columns of a file; raises LogError where there are none."""
    return Table(_columns(path))


READER = table_reader(
    "mat",
    "MATLAB file: .mat, of version 7.3 with the extra `matlab`",
    (".mat",),
    "MATLAB file",
    sniff,
    table,
    lambda path: _columns(path).names,
)
