"""Provide the text of a table file as bytes: unzipped, and in an encoding in which a line ends in one byte.

A file that is already so is read directly; any other is unpacked or transcoded into a temporary file, piece by piece, so that no
table is in memory as text.
"""

from __future__ import annotations

import codecs
import io
import re
import zlib
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from fieldsid.errors import LogError
from fieldsid.logs.readers._unpacked import GZIP, LONGEST_ROW, PIECE_BYTES, UnpackedRows, gunzipped
from fieldsid.logs.unknown_file import COPY_AGAIN

HEAD = LONGEST_ROW
"""Number of bytes at the start of a table from which its form is found."""
LONGEST_CELL = 64
"""Overlap of the pieces in which a cell is searched, so that a cell across their border is found."""


@dataclass(frozen=True, slots=True)
class PlainText:
    """The bytes of a table, with their encoding and number; `is_cut` says that their gzip stream ended early."""

    stream: IO[bytes]
    encoding: str
    size: int
    is_cut: bool

    def head(self) -> str:
        """Return the text of the first HEAD bytes; an incomplete character at their end is replaced."""
        self.stream.seek(0)
        return self.stream.read(HEAD).decode(self.encoding, errors="replace")

    def offset_of_line(self, line: int) -> int:
        """Return the byte offset at which a line, counted from 0, starts."""
        self.stream.seek(0)
        return sum(len(self.stream.readline()) for _ in range(line))

    def last_line(self) -> tuple[int, bytes]:
        """Return the offset after the last line end, and the bytes that follow, at most one more than a row can have."""
        begin = behind = self.size
        while begin == behind > 0:
            start = max(0, behind - PIECE_BYTES)
            begin = start + self._piece(start, behind - start).rfind(b"\n") + 1
            behind = start
        return begin, self._piece(begin, min(self.size - begin, LONGEST_ROW + 1))

    def count(self, what: bytes, begin: int, end: int) -> int:
        """Return the number of occurrences of a byte between two offsets."""
        return sum(self._piece(at, min(PIECE_BYTES, end - at)).count(what) for at in range(begin, end, PIECE_BYTES))

    def holds(self, what: re.Pattern[bytes], mark: bytes, begin: int, end: int) -> bool:
        """Whether a cell that matches an expression, and contains the byte `mark`, is between two offsets."""
        pieces = (
            self._piece(max(begin, at - LONGEST_CELL), min(PIECE_BYTES + LONGEST_CELL, end - at))
            for at in range(begin, end, PIECE_BYTES)
        )
        return any(mark in piece and what.search(piece) is not None for piece in pieces)

    def is_blank(self) -> bool:
        """Whether the text has only white space."""
        return not any(self._piece(at, PIECE_BYTES).strip() for at in range(0, self.size, PIECE_BYTES))

    def between(self, begin: int, end: int) -> io.BufferedReader:
        """Return the bytes between two offsets as a separate stream."""
        return io.BufferedReader(_Slice(self.stream, begin, end), PIECE_BYTES)

    def _piece(self, start: int, size: int) -> bytes:
        self.stream.seek(start)
        return self.stream.read(size)


class _Slice(io.RawIOBase):
    """The bytes of a stream between two offsets, as a stream."""

    def __init__(self, stream: IO[bytes], begin: int, end: int) -> None:
        self.stream = stream
        self.at = begin
        self.end = end

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        self.stream.seek(self.at)
        piece = self.stream.read(min(len(buffer), self.end - self.at))
        buffer[: len(piece)] = piece
        self.at += len(piece)
        return len(piece)


@contextmanager
def plain_text(path: Path, stated: str | None = None, limit: int | None = None) -> Iterator[PlainText]:
    """Yield the text of a file; with `limit` only about so many bytes of a packed or transcoded one.

    The encoding is `stated`, else that of the byte order mark, else UTF-8, else Windows-1252. Raises LogError when nothing can be
    unzipped, and when the bytes are no text.
    """
    with ExitStack() as stack:
        stream: IO[bytes] = stack.enter_context(path.open("rb"))
        is_cut = False
        if stream.read(len(GZIP)) == GZIP:
            stream.seek(0)
            packed, stream = stream, stack.enter_context(TemporaryFile())
            is_cut = _unzip(packed, stream, path, limit)
        stream.seek(0)
        head = stream.read(HEAD)
        encoding = stated or _encoding(head)
        try:
            if _needs_transcoding(encoding, head):
                other, stream = stream, stack.enter_context(TemporaryFile())
                _transcode(other, stream, encoding, "strict" if stated else "replace", limit)
                encoding = "utf-8"
            elif stated:
                deque(_decoded(stream, stated, "strict"), maxlen=0)  # raises where the bytes do not have this encoding
        except (UnicodeDecodeError, LookupError) as error:
            hint = "leave `encoding` out of the mapping: it is found out"
            raise LogError(f"`{path}` is not text in {encoding}", found=str(error), hint=hint) from error
        stream.seek(0)
        if b"\x00" in stream.read(4096):
            raise LogError(f"`{path}` is not a text table", found="zero bytes", hint="give a table of text, Parquet or a bag")
        yield PlainText(stream, encoding, stream.seek(0, io.SEEK_END), is_cut)


def _unzip(packed: IO[bytes], plain: IO[bytes], path: Path, limit: int | None) -> bool:
    """Unpack consecutive gzip streams; return whether the last one ends early.

    Raises LogError where nothing can be unpacked, and for what is no table.
    """
    rows = UnpackedRows(path)
    try:
        for text, size in gunzipped(packed):
            plain.write(text)
            rows.add(text, size)
            if limit is not None and plain.tell() >= limit:
                break
    except (zlib.error, EOFError) as error:
        if isinstance(error, zlib.error) and not plain.tell():
            found = f"{path.stat().st_size} bytes"
            raise LogError(f"`{path}` is not a readable gzip file: {error}", found=found, hint=COPY_AGAIN) from error
        return True
    return False


def _needs_transcoding(encoding: str, head: bytes) -> bool:
    """Whether a line end is not one byte, or is a carriage return alone; raises LookupError for an unknown encoding."""
    if encoding != "utf-8-sig" and "\n".encode(encoding) != b"\n":
        return True
    return b"\n" not in head and b"\r" in head


def _transcode(other: IO[bytes], plain: IO[bytes], encoding: str, errors: str, limit: int | None) -> None:
    """Write a text as UTF-8 with line feeds as line ends."""
    has_line_feeds: bool | None = None
    for text in _decoded(other, encoding, errors):
        has_line_feeds = "\n" in text if has_line_feeds is None else has_line_feeds
        plain.write((text if has_line_feeds else text.replace("\r", "\n")).encode("utf-8"))
        if limit is not None and plain.tell() >= limit:
            break


def _decoded(stream: IO[bytes], encoding: str, errors: str) -> Iterator[str]:
    """Yield the text of a stream from its start, piece by piece; raises UnicodeDecodeError for bytes of another encoding."""
    stream.seek(0)
    return codecs.iterdecode(iter(lambda: stream.read(PIECE_BYTES), b""), encoding, errors)


def _encoding(raw: bytes) -> str:
    for mark, name in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if raw.startswith(mark):
            return name
    head = raw[:512]
    if head.count(b"\x00") > len(head) // 4:
        return "utf-16-le" if head[1::2].count(b"\x00") > head[::2].count(b"\x00") else "utf-16-be"
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError as error:
        # The head may end inside a character; anything else that is not UTF-8 is taken for Windows-1252.
        return "utf-8" if error.start >= len(raw) - 3 else "cp1252"
    return "utf-8"
