"""Check the elements of a MATLAB file of version 5 before scipy reads them.

The compiled reader of scipy trusts types and lengths: a damaged one ends the process, with no error to catch. The layout is that
of MathWorks, MAT-File Format (2024), chapter 1: tags of a type and a length, arrays as elements inside elements.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from math import prod
from pathlib import Path

from fieldsid.errors import LogError
from fieldsid.logs.readers._unpacked import UnpackedSize
from fieldsid.logs.unknown_file import COPY_AGAIN

HEAD = 128
MATRIX, COMPRESSED = 14, 15
NUMBERS = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}
"""Bytes of a number by the type of its element."""
TEXT = {**NUMBERS, 16: 1, 17: 1, 18: 1}
CELL, STRUCT, OBJECT, CHAR, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
NUMERIC = range(6, 16)
COMPLEX = 0x0800
MOST_DIMENSIONS = 32
DEEPEST = 50
NAMES, INTEGERS = (1, 2, 16), (5, 6)


class _DamagedError(Exception):
    """An element that the format does not allow."""


def refuse_damaged(path: Path) -> None:
    """Raise LogError where an element of a file has a type, a length or a dimension that the format does not allow."""
    data, size = path.read_bytes(), UnpackedSize(path)
    try:
        _check_file(memoryview(data), size)
    except (_DamagedError, zlib.error, struct.error) as error:
        raise LogError(f"`{path}` is a MATLAB file that is damaged", found=str(error), hint=COPY_AGAIN) from error


def _check_file(data: memoryview, size: UnpackedSize) -> None:
    order = {b"IM": "<", b"MI": ">"}.get(bytes(data[126:128]))
    if order is None:
        raise _DamagedError("no mark of the order of bytes")
    for kind, body in _elements(data[HEAD:], order, padded=False):
        packed = _unpacked(body, size) if kind == COMPRESSED else None
        for inner, array in ((kind, body),) if packed is None else _elements(packed, order, padded=False):
            if inner != MATRIX:
                raise _DamagedError(f"an element of type {inner} among the variables")
            _check_array(array, order, 0)


def _unpacked(body: memoryview, size: UnpackedSize) -> memoryview:
    unpack = zlib.decompressobj()
    data = unpack.decompress(body, size.left + 1)
    size.add(len(data))
    if not unpack.eof:
        raise _DamagedError("a packed variable that is cut off")
    return memoryview(data)


def _elements(data: memoryview, order: str, *, padded: bool = True) -> Iterator[tuple[int, memoryview]]:
    """Yield type and body of each element in some bytes.

    With `padded` the bodies are padded to 8 bytes, as inside an array; at the level of the file they are not.
    """
    at = 0
    while at < len(data):
        (first,) = struct.unpack_from(f"{order}I", data, at)
        if first >> 16:  # the tag of a small element has 8 bytes, which include its length and up to four bytes of data
            kind, length, start = first & 0xFFFF, first >> 16, at + 4
            if length > 4:
                raise _DamagedError(f"a small element of {length} bytes")
            after = at + 8
        else:
            (length,) = struct.unpack_from(f"{order}I", data, at + 4)
            kind, start = first, at + 8
            after = start + (-(-length // 8) * 8 if padded else length)
        if start + length > len(data):
            raise _DamagedError(f"an element of {length} bytes where {len(data) - start} are left")
        yield kind, data[start : start + length]
        at = after


def _check_array(data: memoryview, order: str, depth: int) -> None:
    """Check one array and the arrays inside it; raises _DamagedError."""
    if depth > DEEPEST:
        raise _DamagedError(f"arrays inside arrays, {depth} deep")
    if not len(data):
        return
    parts = _elements(data, order)
    flags = _next(parts, INTEGERS)
    if len(flags) != 8:
        raise _DamagedError(f"flags of {len(flags)} bytes")
    (word,) = struct.unpack_from(f"{order}I", flags)
    inner = _skipped_opaque(parts) if word & 0xFF == OPAQUE else _checked_array(parts, order, word)
    if inner * 8 > len(data):
        raise _DamagedError(f"{inner} arrays in {len(data)} bytes")
    for _ in range(inner):
        _check_array(_next(parts, (MATRIX,)), order, depth + 1)


def _skipped_opaque(parts: Iterator[tuple[int, memoryview]]) -> int:
    """Skip the three names of an object that only MATLAB can read; return how many arrays follow."""
    for _ in range(3):
        _next(parts, NAMES)
    return 1


def _checked_array(parts: Iterator[tuple[int, memoryview]], order: str, word: int) -> int:
    """Check the dimensions, the name and the numbers of an array whose flags are `word`; return how many arrays follow."""
    size = _next(parts, INTEGERS)
    dimensions: tuple[int, ...] = struct.unpack(f"{order}{len(size) // 4}i", size[: len(size) // 4 * 4])
    if not 1 <= len(dimensions) <= MOST_DIMENSIONS or min(dimensions) < 0:
        raise _DamagedError(f"an array of {dimensions}")
    _next(parts, NAMES)
    kind, parts_of_number = word & 0xFF, 2 if word & COMPLEX else 1
    if kind in (CELL, STRUCT, OBJECT):
        return prod(dimensions) * (1 if kind == CELL else _fields(parts, order, has_class=kind == OBJECT))
    if kind in NUMERIC:
        for _ in range(parts_of_number):
            _numbers(parts, prod(dimensions))
    elif kind == CHAR:
        _text(parts)
    elif kind == SPARSE:
        _sparse(parts, order, dimensions, parts_of_number)
    elif kind != FUNCTION:
        raise _DamagedError(f"an array of class {kind}")
    return 1 if kind == FUNCTION else 0


def _next(parts: Iterator[tuple[int, memoryview]], kinds: tuple[int, ...]) -> memoryview:
    kind, body = next(parts, (0, memoryview(b"")))
    if kind not in kinds:
        raise _DamagedError(f"an element of type {kind} where one of {', '.join(map(str, kinds))} belongs")
    return body


def _numbers(parts: Iterator[tuple[int, memoryview]], count: int) -> None:
    kind, body = next(parts, (0, memoryview(b"")))
    if kind not in NUMBERS or len(body) != count * NUMBERS[kind]:
        raise _DamagedError(f"{count} numbers in an element of type {kind} of {len(body)} bytes")


def _text(parts: Iterator[tuple[int, memoryview]]) -> None:
    # The number of bytes of a letter depends on its encoding, and an empty text has no element at all.
    kind, body = next(parts, (0, memoryview(b"")))
    if len(body) and kind not in TEXT:
        raise _DamagedError(f"letters in an element of type {kind}")


def _sparse(parts: Iterator[tuple[int, memoryview]], order: str, dimensions: tuple[int, ...], parts_of_number: int) -> None:
    rows, starts = (_next(parts, INTEGERS) for _ in range(2))
    of_row = struct.unpack(f"{order}{len(rows) // 4}i", rows[: len(rows) // 4 * 4])
    of_column = struct.unpack(f"{order}{len(starts) // 4}i", starts[: len(starts) // 4 * 4])
    fits = len(dimensions) == 2 and len(of_column) == dimensions[1] + 1 and sorted(of_column) == list(of_column)
    fits = fits and of_column[0] == 0 and of_column[-1] <= len(of_row)
    if not fits or any(not 0 <= r < dimensions[0] for r in of_row[: of_column[-1]]):
        raise _DamagedError(f"a sparse array of {dimensions} whose places lie outside of it")
    for _ in range(parts_of_number):
        _next(parts, tuple(NUMBERS))  # MATLAB declares logical values as doubles and writes bytes: their length cannot be checked


def _fields(parts: Iterator[tuple[int, memoryview]], order: str, *, has_class: bool) -> int:
    """Return the number of fields of a struct: the length of all names over that of one name."""
    if has_class:
        _next(parts, NAMES)
    width = _next(parts, INTEGERS)
    if len(width) != 4:
        raise _DamagedError(f"the length of a field's name in {len(width)} bytes")
    longest = int(struct.unpack(f"{order}i", width)[0])
    names = _next(parts, NAMES)
    if longest <= 0 or len(names) % longest:
        raise _DamagedError(f"names of {longest} bytes in {len(names)}")
    return len(names) // longest
