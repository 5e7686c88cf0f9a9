"""What can be had of an LZ4 frame that is cut inside a block; the library hands out whole blocks only.

A block is a row of sequences: a token (literal length, match length), literals, an offset back into what is already
there, and more length bytes where a length is 15 (LZ4 block format 1.6). Frames of linked blocks look back further.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_MIN_MATCH = 4
_STORED = 0x80000000


def lz4_left(data: bytes) -> bytes | None:
    """Return what an LZ4 frame holds up to where its data end; None where they are damaged."""
    decompressor: Any = import_module("lz4.frame").LZ4FrameDecompressor()
    try:
        plain: bytes = decompressor.decompress(data)
    except (RuntimeError, EOFError, ValueError):
        return None
    if decompressor.eof:
        return plain
    last = _last_block(data)
    return plain if last is None else plain + _sequences(last, plain)


def _last_block(data: bytes) -> bytes | None:
    """Return the bytes of the compressed block that the end cuts, or None when there is none."""
    if len(data) < 7:
        return None
    flags = data[4]
    pos = 7 + (8 if flags & 0x08 else 0) + (4 if flags & 0x01 else 0)
    trailer = 4 if flags & 0x10 else 0
    while pos + 4 <= len(data):
        size = int.from_bytes(data[pos : pos + 4], "little")
        length = size & (_STORED - 1)
        pos += 4
        if pos + length > len(data):
            return None if size & _STORED or size == 0 else data[pos:]
        pos += length + trailer
    return None


def _sequences(block: bytes, before: bytes) -> bytes:
    """Decode the whole sequences of a block that may look back into what came before it."""
    out = bytearray(before[-65536:])
    start = len(out)
    pos, end = 0, len(block)
    while pos < end:
        token = block[pos]
        literals, pos = _length(block, token >> 4, pos + 1)
        if pos + literals + 2 > end:
            out += block[pos : pos + literals]
            break
        out += block[pos : pos + literals]
        pos += literals
        offset = block[pos] | block[pos + 1] << 8
        match, pos = _length(block, token & 15, pos + 2)
        if offset == 0 or offset > len(out) or pos > end:
            break
        _copy(out, offset, match + _MIN_MATCH)
    return bytes(out[start:])


def _length(block: bytes, first: int, pos: int) -> tuple[int, int]:
    """Return a length and the place after it; a place beyond the end means that it is cut."""
    total = first
    if first == 15:
        while True:
            if pos >= len(block):
                return 0, len(block) + 1
            total += block[pos]
            pos += 1
            if block[pos - 1] != 255:
                break
    return total, pos


def _copy(out: bytearray, offset: int, length: int) -> None:
    """Repeat what stands `offset` bytes back; it may overlap with what is being written."""
    begin = len(out) - offset
    if offset >= length:
        out += out[begin : begin + length]
        return
    piece = bytes(out[begin:])
    out += (piece * (length // offset + 1))[:length]
