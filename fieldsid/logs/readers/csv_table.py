"""Tables of text: any separator, header or none, leading lines of words, gzip, UTF-8/16 or Windows-1252, decimal comma."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.reader import ChannelInfo, FieldInfo, Inventory, RawLog, Reader, ReadOptions
from fieldsid.logs.readers._columns import Columns, own_map_of, series_of
from fieldsid.logs.readers._text import GZIP, MISSING, Form, bytes_of, cells, form_of, head_of, offset_of_line, one_byte_text
from fieldsid.logs.run import Note

BINARY = (
    b"PAR1",
    b"SQLite format",
    b"\x89MCAP",
    b"#ROSBAG",
    b"\x89HDF",
    b"PK\x03\x04",
    b"%PDF",
    b"\x28\xb5\x2f\xfd",
    b"\x7fELF",
    b"BZh",
)

_LINE = re.compile(r"line (\d+)")
HEAD = 1 << 18
"""Bytes at the start of a table that tell how it is written."""


def sniff(path: Path) -> bool:
    """Whether a file may be text: anything that has no binary format's signature."""
    if path.is_dir():
        return False
    with path.open("rb") as stream:
        head = stream.read(512)
    if head.startswith(GZIP) or head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    return not head.startswith(BINARY) and (b"\x00" not in head or head.count(b"\x00") > len(head) // 4)


def inventory(path: Path, options: ReadOptions, form: TableForm) -> Inventory:
    """Return the columns with their count of numbers, the table's rate and the first values."""
    table = _Table(path, form, options)
    frame = table.frame()
    channels = tuple(_channel(table.form.label(i), frame.iloc[:, i]) for i in range(table.form.width))
    found = TableForm(
        table.form.separator, bool(table.form.names), table.form.start, form.encoding, "," if table.form.decimal == "," else "."
    )
    return Inventory(path, "text table", float("nan"), channels, found, tuple(table.notes))


def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the mapped columns; raises MappingError for a column that is not there, LogError for cells that are no numbers."""
    table = _Table(path, mapping.table, options)
    return series_of(path, table.columns(), mapping, tuple(table.notes), salvage=options.salvage)


def own_map(path: Path, options: ReadOptions) -> ChannelMap | None:
    """Return the mapping of a table with canonical names, or None."""
    raw, _ = bytes_of(path, limit=HEAD)
    if not raw.strip():
        return None
    encoding, raw = one_byte_text(raw, None, path)
    return own_map_of(form_of(head_of(raw, encoding, HEAD), TableForm(), path).names)


class _Table:
    """The bytes of one file, its form, and its cells."""

    def __init__(self, path: Path, asked: TableForm, options: ReadOptions) -> None:
        self.path = path
        self.salvage = options.salvage
        self.notes: list[Note] = []
        raw, cut = bytes_of(path)
        if not raw[:HEAD].strip() and not raw.strip():
            raise LogError(f"`{path}` is empty", found="no text inside", hint="copy it from the vehicle again")
        self.encoding, self.raw = one_byte_text(raw, asked.encoding, path)
        self.form: Form = form_of(head_of(self.raw, self.encoding, HEAD), asked, path)
        self.begin = offset_of_line(self.raw, self.form.start)
        self.end = len(self.raw)
        if cut:
            self._cut()
        else:
            self._drop_half_a_line()

    def _cut(self) -> None:
        """A gzip stream that ends early: its last line is not whole, and what is left is taken on request only."""
        self.end = max(self.raw.rfind(b"\n") + 1, self.begin)
        rows = self.raw.count(b"\n", self.begin, self.end)
        if not self.salvage:
            raise LogError(
                f"`{self.path}` is a truncated gzip file",
                found=f"{rows} whole rows before the end",
                hint=f"copy it again, or take what is left: `sysid import {self.path} --salvage -o runs/`",
            )
        self.notes.append(Note("truncated", f"the gzip file is cut off; {rows} rows were left", {"rows": rows}))

    def _drop_half_a_line(self) -> None:
        """A plain file that was cut off ends in a line with too few cells."""
        begin = self.raw.rfind(b"\n") + 1
        last = self.raw[begin:].decode(self.encoding, errors="replace")
        if begin > self.begin and last.strip() and len(cells(last, self.form.separator)) < self.form.width:
            self.end = begin
            self.notes.append(
                Note("truncated", "the file is cut off inside its last line, which was left out", {"line": last[:80]})
            )

    def _rows(self) -> io.BytesIO:
        """Return the bytes from the first row of numbers on."""
        stream = io.BytesIO(self.raw if self.end == len(self.raw) else self.raw[: self.end])
        stream.seek(self.begin)
        return stream

    def columns(self) -> Columns:
        """Return the columns as they are asked for one by one."""
        frame = self.frame()
        return Columns(self.path, self.form.names, self.form.width, lambda i: frame.iloc[:, i].to_numpy())

    def frame(self) -> Any:
        """Return all cells: numbers where a column holds nothing else, words otherwise."""
        import pandas as pd

        form = self.form
        try:
            frame = pd.read_csv(
                self._rows(),
                sep=r"\s+" if form.separator == "whitespace" else form.separator,
                header=None,
                names=list(range(form.width)),
                index_col=False,
                decimal=form.decimal,
                **_exact(pd.__version__),
                na_values=sorted(MISSING | {m.upper() for m in MISSING} | {m.title() for m in MISSING}),
                skipinitialspace=True,
                comment="#",
                encoding=self.encoding,
                encoding_errors="replace",
                on_bad_lines="skip" if self.salvage else "error",
                low_memory=False,
            )
        except (pd.errors.ParserError, pd.errors.EmptyDataError, ValueError) as error:
            raise LogError(
                f"`{self.path}` has a row that does not fit its {form.width} columns",
                found=_LINE.sub(lambda m: f"line {int(m[1]) + form.start}", str(error).strip().rpartition("error: ")[2]),
                hint=f"mend the line, or leave such rows out: `sysid import {self.path} --salvage -o runs/`",
            ) from error
        if self.salvage:
            self._count_bad_rows(len(frame))
        return frame

    def _count_bad_rows(self, kept: int) -> None:
        lines = (line.strip() for line in self._rows())
        left_out = sum(1 for line in lines if line and not line.startswith(b"#")) - kept
        if left_out > 0:
            self.notes.append(
                Note("bad_rows", f"rows left out because they have too many cells: {left_out}", {"count": left_out})
            )


def _exact(version: str) -> dict[str, Any]:
    """Ask pandas for the last digit; from 3.1 on it gives it unasked, and warns when asked."""
    major, minor = (int(n) for n in version.split(".")[:2])
    return {} if (major, minor) >= (3, 1) else {"float_precision": "round_trip"}


def _channel(name: str, column: Any) -> ChannelInfo:
    values: npt.NDArray[Any] = column.to_numpy()
    numeric = values.dtype.kind in "fiub"
    seen = np.isfinite(values.astype(float)) if numeric else ~column.isna().to_numpy()
    first: Sequence[Any] = values[seen][:3].tolist()
    kind = "number" if numeric else "text"
    span = (float(values[seen].min()), float(values[seen].max())) if numeric and seen.any() else None
    return ChannelInfo(name, kind, int(seen.sum()), float("nan"), (FieldInfo("", kind, tuple(first), span),))


READER = Reader(
    name="csv_table",
    says="text table: .csv, .csv.gz, .tsv, .txt, .dat",
    suffixes=(".csv", ".csv.gz", ".tsv", ".txt", ".dat"),
    sniff=sniff,
    inventory=inventory,
    read=read,
    own_map=own_map,
)
