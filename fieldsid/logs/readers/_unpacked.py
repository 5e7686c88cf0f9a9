"""Limit the size of an unpacked log, because a few packed bytes can state, and unpack to, any number of bytes.

The measurements of a log pack by a factor of a few, constant columns by some hundred. A file that exceeds this is no log, and is
refused as soon as that is known, before it fills the memory. The same holds for a table whose rows repeat one another, and for a
line without end.
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
"""Bytes of a gzip stream that are unpacked at once; at most so many before a damaged place cannot be read."""
SMALL = 128 << 20
"""Unpacked bytes that are always accepted, whatever the ratio to the packed ones."""
MOST_TIMES = 300
"""Largest ratio of unpacked to packed bytes of a larger log; a table of 300 columns, most of them constant, reaches it."""


class UnpackedSize:
    """Count the bytes to which a log of `packed` bytes unpacks; raises LogError where they are too many for a log."""

    def __init__(self, path: Path, packed: int | None = None) -> None:
        self.path = path
        self.packed = path.stat().st_size if packed is None else packed
        self.size = 0

    @property
    def left(self) -> int:
        """Return the number of bytes that may still be unpacked."""
        return max(SMALL, MOST_TIMES * self.packed) - self.size

    def add(self, size: int) -> None:
        """Add bytes that were unpacked, or that the file states it will unpack to."""
        self.size += size
        if self.left < 0:
            raise LogError(
                f"`{self.path}` is no log: it unpacks to far more than a vehicle records",
                found=f"at least {self.size} bytes from {self.packed}",
                hint="write it again with the samples alone, or leave out what is constant",
            )


def gunzipped(packed: IO[bytes], most: Callable[[], int] = lambda: 0) -> Iterator[tuple[bytes, int]]:
    """Yield the unpacked pieces of consecutive gzip streams, each with the number of its packed bytes.

    `most` returns the largest number of bytes of a piece, 0 for no limit. Raises zlib.error for damage, and EOFError for an early
    end.
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
    """Return the bytes of a file, unpacked where it is gzip, and whether its stream is truncated or damaged.

    Raises LogError where it unpacks to more bytes than a log can have.
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
"""Smallest number of packed bytes of a row. With the best compression of gzip a row of a stamp and constants takes 2.1 to 2.6
bytes, measured with nine forms of stamps over 3e5 rows; the noise of a sensor adds to that."""
MANY = 1_000_000
"""Number of rows above which LEAST_BYTES is required; fewer rows take little memory in any case."""
LONGEST_ROW = 1 << 18
"""Largest number of bytes of a row; also the number at the start of a table from which its form is found."""
LINE_ENDS = (b"\n", b"\r")


def refuse_repeated(path: Path, rows: int, packed: int) -> None:
    """Raise LogError where rows are packed into fewer bytes than possible for a log whose time increases."""
    if rows > MANY and packed < LEAST_BYTES * rows:
        raise LogError(
            f"`{path}` is no log: its rows repeat one another",
            found=f"at least {rows} rows in {packed} packed bytes; one with a time of its own takes two or more",
            hint="write the table again from what the vehicle recorded, and pack that",
        )


def refuse_endless(path: Path, size: int, start: str) -> None:
    """Raise LogError for a line that is longer than a row can be and begins with `start`."""
    raise LogError(
        f"`{path}` is no table that can be read: a line of it has no end",
        found=f"none in {size} bytes, which begin {start!r}",
        hint="write a line for each sample, with the columns that are needed",
    )


class UnpackedRows:
    """Count the rows of a text that is unpacked piece by piece, to refuse what is no table as early as possible."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows = 0
        self._size = UnpackedSize(path, 0)
        self._line = 0

    def add(self, text: bytes, packed: int) -> None:
        """Count a piece of text from `packed` bytes; raises LogError for rows that repeat, and for a line without end."""
        self.rows += max(text.count(end) for end in LINE_ENDS)
        self._size.packed += packed
        self._size.add(len(text))
        last = max(text.rfind(end) for end in LINE_ENDS)
        self._line = len(text) - last - 1 if last >= 0 else self._line + len(text)
        refuse_repeated(self.path, self.rows, self._size.packed)
        if self._line > LONGEST_ROW:
            refuse_endless(self.path, self._line, text[-40:].decode("latin-1"))
