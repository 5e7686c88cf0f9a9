"""Packed chunks unpack to what they state and no further: a few bytes may hold any number of zeros."""

from __future__ import annotations

import bz2
from importlib import import_module

import pytest

from fieldsid.logs.readers._unpacked import PIECE_BYTES
from fieldsid.logs.readers.bags.containers import decompress
from fieldsid.logs.readers.bags.containers.decompress import LARGEST, unpack_file, unpacked

PLAIN = bytes(5_000_000)


def packers():
    return {
        "bz2": bz2.compress,
        "lz4": import_module("lz4.frame").compress,
        "zstd": decompress._zstd().compress,
    }


@pytest.mark.parametrize("kind", ["bz2", "lz4", "zstd"])
def test_what_a_chunk_states_is_unpacked_and_one_byte_more_tells_a_longer_one(kind):
    packed = packers()[kind](PLAIN)
    assert unpacked(packed, kind, len(PLAIN)) == PLAIN
    short = unpacked(packed, kind, 1000)
    assert short is not None
    assert 1000 < len(short) <= len(PLAIN) // 4
    assert unpacked(packed, kind, LARGEST + 1) is None


def test_a_packed_file_is_written_piece_by_piece(tmp_path, monkeypatch):
    (tmp_path / "packed").write_bytes(packers()["zstd"](PLAIN) + packers()["zstd"](b"more"))
    monkeypatch.setattr(decompress, "PIECE_BYTES", 65536)
    assert unpack_file(tmp_path / "packed", tmp_path / "plain") is None
    assert (tmp_path / "plain").read_bytes() == PLAIN + b"more"
    assert PIECE_BYTES > 65536
