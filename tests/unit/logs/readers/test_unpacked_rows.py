"""A small file that would unpack to any number of rows is refused; a log that packs well is not."""

from __future__ import annotations

import gzip
import zlib

import numpy as np
import pytest

from fieldsid.errors import LogError
from fieldsid.logs.channels import TableForm
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers._unpacked import LEAST_BYTES, MANY, UnpackedRows
from fieldsid.logs.readers.csv_table import READER as TABLE
from fieldsid.logs.readers.parquet import READER as PARQUET

HEAD = b"time_s,yaw_rad,rudder_rad\n" + b"".join(b"%.1f,0.5,0.1\n" % (0.1 * i) for i in range(100))
STAMPS = {
    "a count": lambda i: f"{i},0.5,0",
    "tenths": lambda i: f"{i / 10:.1f},0.5,0",
    "hundredths": lambda i: f"{i / 100:.2f},0.5,0",
    "20 ms": lambda i: f"{i / 50:.3f},0",
    "an epoch": lambda i: f"{1.7e9 + i / 20:.3f},1.00,2.00",
    "a date": lambda i: f"2026-03-01T{i // 72000:02d}:{i // 1200 % 60:02d}:{i % 1200 / 20:06.3f},1,2",
    "ns": lambda i: f"{1700000000000000000 + i * 50000000},1",
}


@pytest.mark.parametrize("stamp", STAMPS)
def test_rows_with_a_clock_of_their_own_take_twice_what_is_asked(stamp):
    count = 50_000
    packed = zlib.compress("\n".join(STAMPS[stamp](i) for i in range(count)).encode(), 9)
    assert len(packed) > 2.0 * LEAST_BYTES * count


def packed_in_pieces(path, piece, count):
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    with path.open("wb") as stream:
        stream.write(packer.compress(HEAD))
        for _ in range(count):
            stream.write(packer.compress(piece))
        stream.write(packer.flush())
    return path


def test_rows_that_repeat_are_refused_before_they_are_unpacked(tmp_path):
    path = packed_in_pieces(tmp_path / "log.csv.gz", b"1.0,0.5,0.1\n" * 100_000, 40)
    assert path.stat().st_size < 100_000
    with pytest.raises(LogError, match="its rows repeat one another") as error:
        TABLE.inventory(path, ReadOptions(), TableForm())
    rows = int(error.value.found.split()[2])
    assert MANY < rows < 1.5 * MANY  # not the 4e6 that are in it


def test_a_line_without_an_end_is_refused_before_it_is_unpacked(tmp_path):
    path = packed_in_pieces(tmp_path / "log.csv.gz", b"1" * 1_000_000, 40)
    with pytest.raises(LogError, match="a line of it has no end") as error:
        TABLE.inventory(path, ReadOptions(), TableForm())
    assert int(error.value.found.split()[2]) < 2_000_000


def test_a_line_without_an_end_behind_good_rows_is_refused(tmp_path):
    (tmp_path / "log.csv").write_bytes(HEAD + b"1" * 3_000_000)
    with pytest.raises(LogError, match="a line of it has no end"):
        TABLE.inventory(tmp_path / "log.csv", ReadOptions(), TableForm())


def test_columns_that_never_change_are_no_reason_beside_a_clock():
    rows = UnpackedRows("log.csv.gz")
    text = "".join(f"{i / 100:.2f}" + ",NaN" * 5 + "\n" for i in range(MANY + 1000)).encode()
    packed = gzip.compress(text, 6)
    rows.add(text, len(packed))
    assert rows.rows == MANY + 1000


def test_a_parquet_table_whose_rows_repeat_is_refused_unread(tmp_path):
    arrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    names = ("time_s", "yaw_rad", "rudder_rad")
    table = arrow.table({n: arrow.array(np.zeros(3 * MANY)) for n in names})
    parquet.write_table(table, tmp_path / "log.parquet")
    with pytest.raises(LogError, match="its rows repeat one another"):
        PARQUET.inventory(tmp_path / "log.parquet", ReadOptions(), TableForm())
