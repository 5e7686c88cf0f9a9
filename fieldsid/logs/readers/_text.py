"""Text of a table file and its form: encoding, separator, decimal sign, first line of numbers, header."""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass
from pathlib import Path

from fieldsid.errors import LogError
from fieldsid.logs.channels import TableForm

GZIP = b"\x1f\x8b"
SEPARATORS = ("\t", ";", ",", "|", "whitespace")
LOOKED_AT_BYTES = 1 << 18
LOOKED_AT = 400
"""Lines at the start of a file among which the first row of numbers must be."""
AGREEING = 20
"""Rows that must have as many cells as the first."""

Score = tuple[int, float, int]
"""Rows that agree with the first, share of its cells that are no words, and its columns."""

_NUMBER = re.compile(r"^[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?$")
_COMMA_NUMBER = re.compile(r"^[+-]?(\d+,\d+|\d+)([eE][+-]?\d+)?$")
_DATE = re.compile(r"^\d{4}-\d\d-\d\d([T ]\d\d:\d\d(:\d\d(\.\d*)?)?)?(Z|[+-]\d\d:?\d\d)?$")
MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf", "-nan", "infinity", "-"})
COMMENTS = "#%"


@dataclass(frozen=True, slots=True)
class Form:
    """How a table is written: `start` is the line of its first row, `names` what the header calls the columns."""

    separator: str
    decimal: str
    start: int
    width: int
    names: tuple[str, ...]

    def label(self, index: int) -> str:
        """The name of a column, or its index where there is no header."""
        return self.names[index] if self.names else str(index)


def bytes_of(path: Path, limit: int = 0) -> tuple[bytes, bool]:
    """Return a file's bytes, unzipped, and whether a gzip stream ends early; only the first `limit` bytes when given.

    Raises LogError when nothing can be unzipped.
    """
    with path.open("rb") as stream_in:
        raw = stream_in.read(limit or -1)
    if not raw.startswith(GZIP):
        return raw, False
    if limit:
        try:
            return zlib.decompressobj(wbits=31).decompress(raw, limit), False
        except zlib.error:
            raw = path.read_bytes()
    parts: list[bytes] = []
    while raw.startswith(GZIP):
        stream = zlib.decompressobj(wbits=31)
        try:
            parts.append(stream.decompress(raw))
        except zlib.error as error:
            return b"".join(parts) + _up_to_damage(raw, path, error), True
        if not stream.eof:
            return b"".join(parts), True
        raw = stream.unused_data
    return b"".join(parts), False


def _up_to_damage(raw: bytes, path: Path, error: zlib.error) -> bytes:
    """Feed a damaged stream in small pieces and keep what comes out."""
    stream, parts = zlib.decompressobj(wbits=31), []
    try:
        for i in range(0, len(raw), 512):
            piece = stream.decompress(raw[i : i + 512])
            parts.append(piece)
    except zlib.error:
        pass
    if not any(parts):
        raise LogError(
            f"`{path}` is not a readable gzip file: {error}", found=f"{len(raw)} bytes", hint="copy it from the vehicle again"
        )
    return b"".join(parts)


def one_byte_text(raw: bytes, encoding: str | None, path: Path) -> tuple[str, bytes]:
    """Return an encoding in which a line ends in one byte, and the text in it; UTF-16 becomes UTF-8.

    The encoding is the one asked for, else by byte order mark, else UTF-8, else Windows-1252. Raises LogError when
    the bytes are no text.
    """
    named = encoding or _encoding(raw[:LOOKED_AT_BYTES])
    try:
        if "\n".encode(named) != b"\n" and named != "utf-8-sig":
            named, raw = "utf-8", raw.decode(named, errors="strict" if encoding else "replace").encode("utf-8")
        elif encoding:
            raw.decode(named)
    except (UnicodeDecodeError, LookupError) as error:
        hint = "name the encoding in the mapping: `table: {encoding: cp1252}`"
        raise LogError(f"`{path}` is not text in {named}", found=str(error), hint=hint) from error
    if b"\x00" in raw[:4096]:
        raise LogError(f"`{path}` is not a text table", found="zero bytes", hint="give a table of text, Parquet or a bag")
    return named, raw if b"\n" in raw else raw.replace(b"\r", b"\n")


def head_of(raw: bytes, encoding: str, size: int) -> str:
    """Return the text at the start of a file; a character that the cut splits is replaced."""
    return raw[:size].decode(encoding, errors="replace")


def offset_of_line(raw: bytes, line: int) -> int:
    """Return the byte at which a line starts, counted from 0."""
    at = 0
    for _ in range(line):
        at = raw.index(b"\n", at) + 1
    return at


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
        # A piece of a file may end inside a character; anything else that is no UTF-8 is Windows text.
        return "utf-8" if error.start >= len(raw) - 3 else "cp1252"
    return "utf-8"


def form_of(text: str, asked: TableForm, path: Path) -> Form:
    """Find out how a table is written, as far as `asked` leaves it open; raises LogError when there is no row of numbers."""
    lines = text.split("\n", LOOKED_AT + AGREEING)[: LOOKED_AT + AGREEING]
    lines = [line.rstrip("\r") for line in lines]
    first = asked.skip or 0
    best: Form | None = None
    best_score = (0, 0.0, 0)
    for separator in [asked.separator] if asked.separator else SEPARATORS:
        form, score = _try(lines, first, separator, asked)
        if form is not None and score > best_score:
            best, best_score = form, score
    if best is None:
        shown = next((line for line in lines if line.strip()), "")[:80]
        if sum(bool(line.strip()) for line in lines) == 1:
            raise LogError(f"`{path}` has no rows", found=f"one line: {shown!r}", hint="copy it from the vehicle again")
        raise LogError(
            f"`{path}` holds no table of numbers",
            found=f"first line: {shown!r}",
            hint="say how it is written in the mapping: `table: {separator: ';', skip: 4}`",
        )
    return best


def _try(lines: list[str], first: int, separator: str, asked: TableForm) -> tuple[Form | None, Score]:
    """Return the form by one separator, and its score."""
    decimals = [asked.decimal] if asked.decimal else ["."] if separator == "," else [".", ","]
    best: tuple[Form | None, Score] = (None, (0, 0.0, 0))
    for decimal in decimals:
        for at in range(first, len(lines)):
            row = cells(lines[at], separator)
            if len(row) < 2 or not _is_row(row, decimal):
                continue
            rows = [r for line in lines[at + 1 : at + AGREEING] if line.strip() and len(r := cells(line, separator)) > 0]
            agreeing = 1 + sum(len(r) == len(row) and _is_row(r, decimal) for r in rows)
            if agreeing * 2 <= len(rows):
                continue
            score = (agreeing, sum(not _is_word(c, decimal) for c in row) / len(row), len(row))
            if score > best[1]:
                names = _header(lines, at, first, separator, len(row), asked=asked.header)
                best = Form(separator, decimal, at, len(row), names), score
            break
    return best


def cells(line: str, separator: str) -> list[str]:
    """Return a line's cells without blanks and quotes."""
    parts = line.split() if separator == "whitespace" else line.split(separator)
    return [p.strip().strip("\"'").strip() for p in parts]


def _is_row(row: list[str], decimal: str) -> bool:
    """Whether a line is data: it holds a number, and what is no number is a date, missing or a word among numbers."""
    words = sum(_is_word(c, decimal) for c in row)
    missing = sum(c.lower() in MISSING for c in row)
    said = len(row) - words - missing
    return said > 0 and words <= said and not row[0].startswith(tuple(COMMENTS))


def _is_word(cell: str, decimal: str) -> bool:
    """Whether a cell is no number, no date and not one of the ways to say that there is none."""
    number = _NUMBER if decimal == "." else _COMMA_NUMBER
    return not (number.match(cell) or _DATE.match(cell) or cell.lower() in MISSING)


def _header(lines: list[str], at: int, first: int, separator: str, width: int, *, asked: bool | None) -> tuple[str, ...]:
    if asked is False:
        return ()
    for i in range(at - 1, max(first, 0) - 1, -1):
        if not lines[i].strip():
            continue
        names = _names(lines[i], separator, width)
        if names:
            return names
        if not lines[i].lstrip().startswith(tuple(COMMENTS)) and not _are_units(lines[i], separator, width):
            return ()
    return ()


def _names(line: str, separator: str, width: int) -> tuple[str, ...]:
    """Return a header line's names when it has one word for each column, else nothing."""
    bare = line.strip().lstrip(COMMENTS).strip() if line.lstrip().startswith(tuple(COMMENTS)) else line
    names = cells(bare, separator)
    if len(names) != width or any(_NUMBER.match(n) or _DATE.match(n) for n in names) or not any(names):
        return ()
    return () if _are_units(line, separator, width) else tuple(names)


def _are_units(line: str, separator: str, width: int) -> bool:
    """Whether a line below the names only states units, such as `[s];[deg];[deg/s]`."""
    parts = cells(line, separator)
    return len(parts) == width and all(p == "" or (p[:1] in "[(" and p[-1:] in "])") for p in parts)
