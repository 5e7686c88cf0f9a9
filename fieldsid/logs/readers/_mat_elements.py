"""Read the numbers of a MATLAB file of version 5: its numeric arrays, and those in the fields of its structs.

A compiled reader that trusts types and lengths would end the process at a damaged one. The layout is that of MathWorks, MAT-File
Format (2024), chapter 1: tags of a type and a length, arrays as elements inside elements. Arrays that hold no columns (texts,
cells, objects, sparse and complex ones) are passed over.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.readers._unpacked import UnpackedSize
from fieldsid.logs.unknown_file import COPY_AGAIN

HEAD = 128
MATRIX, COMPRESSED = 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""NumPy's type of a number by the type of its element."""
STRUCT, NUMERIC, CLASSES = 2, range(6, 16), range(1, 18)
COMPLEX = 0x0800
DEEPEST = 5
NAMES, INTEGERS = (1, 2, 16), (5, 6)
Arrays = Iterator[tuple[str, npt.NDArray[Any]]]
"""Numeric arrays by name; the name of a field inside a struct of a struct has the names of the structs before it."""


class _DamagedError(Exception):
    """An element that the format does not allow."""


def arrays_of(path: Path) -> Arrays:
    """Yield the numeric arrays of a file.

    Raises LogError where an element has a type, a length or a dimension that the format does not allow.
    """
    data, size = path.read_bytes(), UnpackedSize(path)
    try:
        yield from _arrays_in_file(memoryview(data), size)
    except (_DamagedError, zlib.error, struct.error) as error:
        raise LogError(f"`{path}` is a MATLAB file that is damaged", found=str(error), hint=COPY_AGAIN) from error


def _arrays_in_file(data: memoryview, size: UnpackedSize) -> Arrays:
    order = {b"IM": "<", b"MI": ">"}.get(bytes(data[126:128]))
    if order is None:
        raise _DamagedError("no mark of the order of bytes")
    for kind, body in _elements(data[HEAD:], order, padded=False):
        packed = _unpacked(body, size) if kind == COMPRESSED else None
        for inner, array in ((kind, body),) if packed is None else _elements(packed, order, padded=False):
            if inner != MATRIX:
                raise _DamagedError(f"an element of type {inner} among the variables")
            yield from _arrays_in(array, order, "", 0)


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


def _arrays_in(data: memoryview, order: str, name: str, depth: int) -> Arrays:
    """Yield one array, or the arrays in the fields of one struct; `name` is that of a field, and empty for a variable."""
    if not len(data) or depth > DEEPEST:
        return
    parts = _elements(data, order)
    (word,) = struct.unpack(f"{order}I4x", _next(parts, INTEGERS))
    kind = word & 0xFF
    if kind not in CLASSES:
        raise _DamagedError(f"an array of class {kind}")
    if kind != STRUCT and (kind not in NUMERIC or word & COMPLEX):
        return
    stated = _next(parts, INTEGERS)
    dimensions = struct.unpack(f"{order}{len(stated) // 4}i", stated)
    if not dimensions or min(dimensions) < 0:
        raise _DamagedError(f"an array of {dimensions}")
    variable = bytes(_next(parts, NAMES)).decode("latin-1")
    if kind in NUMERIC:
        yield name or variable, _numbers(parts, order, dimensions)
    elif prod(dimensions) == 1:
        for field in _fields(parts, order):
            yield from _arrays_in(_next(parts, (MATRIX,)), order, f"{name}.{field}" if name else field, depth + 1)


def _next(parts: Iterator[tuple[int, memoryview]], kinds: tuple[int, ...]) -> memoryview:
    kind, body = next(parts, (0, memoryview(b"")))
    if kind not in kinds:
        raise _DamagedError(f"an element of type {kind} where one of {', '.join(map(str, kinds))} belongs")
    return body


def _numbers(parts: Iterator[tuple[int, memoryview]], order: str, dimensions: tuple[int, ...]) -> npt.NDArray[Any]:
    kind, body = next(parts, (0, memoryview(b"")))
    number = np.dtype(f"{order}{NUMBERS.get(kind, 'V1')}")
    if kind not in NUMBERS or len(body) != prod(dimensions) * number.itemsize:
        raise _DamagedError(f"{prod(dimensions)} numbers in an element of type {kind} of {len(body)} bytes")
    return np.frombuffer(body, number).reshape(dimensions, order="F")


def _fields(parts: Iterator[tuple[int, memoryview]], order: str) -> list[str]:
    """Return the names of the fields of a struct, which all have the same number of bytes."""
    (longest,) = struct.unpack(f"{order}i", _next(parts, INTEGERS))
    names = bytes(_next(parts, NAMES))
    if longest <= 0 or len(names) % longest:
        raise _DamagedError(f"names of {longest} bytes in {len(names)}")
    return [names[at : at + longest].partition(b"\0")[0].decode("latin-1") for at in range(0, len(names), longest)]
