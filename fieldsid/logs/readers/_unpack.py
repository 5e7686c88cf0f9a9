"""Decompression of chunks and files, as far as the data go."""

from __future__ import annotations

import bz2
import sys
from importlib import import_module
from typing import Any

from fieldsid.errors import LogError
from fieldsid.logs.readers._lz4 import lz4_left

KNOWN = ("", "none", "bz2", "lz4", "zstd")


def unpacked(data: bytes, compression: str) -> bytes | None:
    """Return the plain bytes, or those up to where the data end; None where the data are damaged.

    Raises LogError for a compression that is not one of KNOWN.
    """
    if compression in ("", "none"):
        return data
    try:
        if compression == "bz2":
            return bz2.BZ2Decompressor().decompress(data)
    except (OSError, EOFError, ValueError):
        return None
    if compression == "lz4":
        return lz4_left(data)
    if compression == "zstd":
        return unzstd(data)
    raise LogError(f"the bag is compressed with {compression!r}", found=compression, hint="record or convert it with zstd or lz4")


def unzstd(data: bytes) -> bytes | None:
    """Return what zstd data hold, up to where they end; None where they are damaged."""
    module: Any = import_module("compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd")
    try:
        return _bytes(module.ZstdDecompressor(), data)
    except (module.ZstdError, EOFError):
        return None


def _bytes(decompressor: Any, data: bytes) -> bytes:
    plain: bytes = decompressor.decompress(data)
    return plain
