"""How large a packed log may become: some bytes can claim, and give, any number of others.

A log's own numbers pack a few times, constants beside them some hundred times; what goes beyond is no log, and is refused before
it fills the memory, as soon as that is known. So are rows of a table that repeat one another, and a line that has no end.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from fieldsid.errors import LogError

GZIP = b"\x1f\x8b"
PIECE_BYTES = 1 << 20
_SMALL_PIECE = 512
"""Bytes of a gzip stream that are unpacked at once: what a damaged one still gives is known to as many."""
SMALL = 128 << 20
"""Unpacked bytes that are read however they were packed."""
MOST_TIMES = 300
"""Times its own bytes that a larger log may unpack to: a table of three hundred columns, most of them constant, comes to that."""


class UnpackedSize:
    """Counts what a log of so many bytes unpacks to; raises LogError where it is more than a log can be."""

    def __init__(self, path: Path, packed: int | None = None) -> None:
        self.path = path
        self.packed = path.stat().st_size if packed is None else packed
        self.size = 0

    @property
    def left(self) -> int:
        """Bytes that may still be unpacked."""
        return max(SMALL, MOST_TIMES * self.packed) - self.size

    def add(self, size: int) -> None:
        """Count bytes that have been unpacked, or that the file says it will unpack to."""
        self.size += size
        if self.left < 0:
            raise LogError(
                f"`{self.path}` is no log: it unpacks to far more than a vehicle records",
                found=f"at least {self.size} bytes from {self.packed}",
                hint="write it again with the samples alone, or leave out what is constant",
            )


def gunzipped(packed: IO[bytes], most: Callable[[], int] = lambda: 0) -> Iterator[tuple[bytes, int]]:
    """Yield what gzip streams hold, as many as follow each other, piece by piece with the packed bytes of each.

    `most` says how many bytes a piece may have, 0 any number. Raises zlib.error for damage, EOFError for an early end.
    """
    stream, piece = zlib.decompressobj(wbits=31), b""
    while piece := piece or packed.read(_SMALL_PIECE):
        if stream.eof:
            if not piece.startswith(GZIP[: len(piece)]):
                return
            stream = zlib.decompressobj(wbits=31)
        plain = stream.decompress(piece, most())
        yield plain, len(piece) - len(stream.unused_data) - len(stream.unconsumed_tail)
        piece = stream.unused_data or stream.unconsumed_tail
    if not stream.eof:
        raise EOFError


def inflated(path: Path) -> tuple[bytes, bool]:
    """Return the bytes of a file, unpacked where it is gzip, and whether they end before its stream does.

    Raises LogError where it unpacks to more than a log does.
    """
    with path.open("rb") as stream:
        if stream.read(len(GZIP)) != GZIP:
            return path.read_bytes(), False
        stream.seek(0)
        out, size = bytearray(), UnpackedSize(path)
        try:
            for piece, _ in gunzipped(stream, lambda: size.left + 1):
                size.add(len(piece))
                out += piece
        except (zlib.error, EOFError):
            return bytes(out), True
    return bytes(out), False


LEAST_BYTES = 1.0
"""Packed bytes that a row must have: with a clock of its own and constants beside it one takes 2.1 to 2.6 at the best that gzip
can, nine forms of stamps over 3e5 rows; the noise of a sensor comes on top."""
MANY = 1_000_000
"""Rows from which on that is asked: fewer take little memory, whatever is in them."""
LONGEST_ROW = 1 << 18
"""Bytes of a line that is a row; also those at the start of a table that tell how it is written."""
LINE_ENDS = (b"\n", b"\r")


def refuse_repeated(path: Path, rows: int, packed: int) -> None:
    """Raise LogError where rows are packed into fewer bytes than those of a log whose time goes on can be."""
    if rows > MANY and packed < LEAST_BYTES * rows:
        raise LogError(
            f"`{path}` is no log: its rows repeat one another",
            found=f"at least {rows} rows in {packed} packed bytes; one with a time of its own takes two or more",
            hint="write the table again from what the vehicle recorded, and pack that",
        )


def refuse_endless(path: Path, size: int, start: str) -> None:
    """Raise LogError for a line that is longer than a row can be, which starts so."""
    raise LogError(
        f"`{path}` is no table that can be read: a line of it has no end",
        found=f"none in {size} bytes, which begin {start!r}",
        hint="write a line for each sample, with the columns that are needed",
    )


class UnpackedRows:
    """Counts the rows of a text that is unpacked piece by piece; what is no table is refused as soon as that shows."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows = 0
        self._size = UnpackedSize(path, 0)
        self._line = 0

    def add(self, text: bytes, packed: int) -> None:
        """Count a piece of text that so many packed bytes gave. Raises LogError for rows that repeat, and a line without end."""
        self.rows += max(text.count(end) for end in LINE_ENDS)
        self._size.packed += packed
        self._size.add(len(text))
        last = max(text.rfind(end) for end in LINE_ENDS)
        self._line = len(text) - last - 1 if last >= 0 else self._line + len(text)
        refuse_repeated(self.path, self.rows, self._size.packed)
        if self._line > LONGEST_ROW:
            refuse_endless(self.path, self._line, text[-40:].decode("latin-1"))
