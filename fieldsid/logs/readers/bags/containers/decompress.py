"""Decompress chunks and files by the libraries of their formats, as far as the data reach.

An incomplete last block of LZ4 or zstd data is not read, because the libraries return complete blocks only.
"""

from __future__ import annotations

import bz2
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from fieldsid.errors import LogError
from fieldsid.logs.readers._unpacked import MOST_TIMES, PIECE_BYTES, UnpackedSize

LARGEST = 1 << 26
"""Largest number of unpacked bytes of a chunk or message that is always accepted: recorders write some 1e6, but damaged data may
state any number. Larger ones are unpacked if their packed bytes are at least 1/MOST_TIMES of that."""
KNOWN = ("", "none", "bz2", "lz4", "zstd")


def unpacked(data: bytes, compression: str, size: int = LARGEST) -> bytes | None:
    """Return the unpacked bytes, of incomplete data those of complete blocks; None where the data are damaged.

    `size` is the expected number of bytes: at most one more is unpacked, and nothing (None) where `size` is implausibly large.
    Raises LogError for a compression that is not one of KNOWN.
    """
    if compression in ("", "none"):
        return data
    if compression not in KNOWN:
        hint = "record or convert it with zstd or lz4"
        raise LogError(f"the bag is compressed with {compression!r}", found=compression, hint=hint)
    if size > max(LARGEST, MOST_TIMES * len(data)):
        return None
    try:
        plain: bytes = _decompressor(compression).decompress(data, size + 1)
    except (OSError, RuntimeError, EOFError, ValueError, _zstd().ZstdError):
        return None
    return plain


def _decompressor(compression: str) -> Any:
    if compression == "bz2":
        return bz2.BZ2Decompressor()
    return import_module("lz4.frame").LZ4FrameDecompressor() if compression == "lz4" else _zstd().ZstdDecompressor()


def unpack_file(packed: Path, plain: Path) -> str | None:
    """Unpack a zstd file into another file, piece by piece; return `cut off` or `damaged`, or None if it is complete.

    Raises LogError where it unpacks to far more bytes than a log can have.
    """
    size = UnpackedSize(packed)
    decompressor = _decompressor("zstd")
    with packed.open("rb") as source, plain.open("wb") as target:
        try:
            while piece := source.read(PIECE_BYTES):
                while piece:
                    if decompressor.eof:
                        decompressor = _decompressor("zstd")
                    size.add(target.write(decompressor.decompress(piece, PIECE_BYTES)))
                    while not (decompressor.eof or decompressor.needs_input):
                        size.add(target.write(decompressor.decompress(b"", PIECE_BYTES)))
                    piece = decompressor.unused_data
        except _zstd().ZstdError:
            return "damaged"
    return None if decompressor.eof else "cut off"


def _zstd() -> Any:
    return import_module("compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd")
