"""Find where the fields of a serialized message are, and decode many messages at once.

Over rosbags: selected numbers 10 times as fast (tests/benchmarks/bag_reading.py), and a damaged message
among others is left out. All types and encodings that rosbags decodes are decoded here as well.

A message is walked through once; the bytes that determine its layout (lengths of strings and sequences) are kept as guards. All
messages with the same size and the same guards have the same layout, so that their fields are columns of one block.
Encodings: ROS 1 (packed, little endian) and CDR (OMG CORBA 3.0, 15.3: a number of k bytes is at a multiple of k).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Nodetype

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.few_of import SHOWN, few_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

DTYPES = {
    "bool": "u1", "byte": "u1", "char": "u1", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4",
    "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
PADDING = "structure_needs_at_least_one_member"
"""Name of the member that ROS 2 adds to an empty structure."""
QUATERNION = ("x", "y", "z", "w")
DEEPEST, MOST_PARTS = 50, 100_000
"""Largest depth of types inside one another, and largest number of them in a message; a real one has fewer."""
ROWS_APART = 32
"""Number of layouts that are matched against all messages of a block before the rest is decoded one by one."""

Columns = tuple[list[npt.NDArray[Any]], npt.NDArray[np.bool_]]
"""For each path the numbers of all messages (n, 1) or (n, 4), NaN where the element is missing; mask (n,) of those decoded."""

Definitions = Mapping[str, Sequence[tuple[str, Any]]]
"""Fields of each message type, as name and description in the form of rosbags."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """A number, or `count` equal numbers in a row, at a byte offset."""

    offset: int
    dtype: np.dtype[Any]
    count: int | None = None


@dataclass(slots=True)
class Layout:
    """The layout of one message: numbers and texts by path, and the byte ranges (guards) that determine it."""

    leaves: dict[str, Leaf] = field(default_factory=dict)
    texts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    ranges: dict[str, tuple[int, int]] = field(default_factory=dict)
    guards: list[tuple[int, int]] = field(default_factory=list)
    end: int = 0


class Walker:
    """Walk through one message from its first byte to its last."""

    def __init__(self, definitions: Definitions, raw: bytes, *, cdr: bool) -> None:
        self.definitions = definitions
        self.raw = raw
        self.cdr = cdr
        self.start = 4 if cdr else 0
        self.order = ">" if cdr and raw[1:2] == b"\x00" else "<"
        self.layout = Layout()
        self.pos = self.start
        self.above: list[str] = []
        self.parts = 0
        if cdr and raw[:2] not in {b"\x00\x00", b"\x00\x01"}:
            raise LogError(
                "a message is in an encoding that is not plain CDR",
                found=f"encapsulation {raw[:2].hex()}",
                hint="re-record with the default RMW",
            )

    def walk(self, type_name: str) -> Layout:
        """Return the layout; raises LogError where the definition does not fit the bytes."""
        if self.cdr:
            self.layout.guards.append((0, 2))
        try:
            self._message(type_name, "")
        except (IndexError, ValueError, OverflowError) as error:
            raise _misfit(type_name, self.pos, len(self.raw)) from error
        left = len(self.raw) - self.pos
        if left < 0 or left > (3 if self.cdr else 0):
            raise _misfit(type_name, self.pos, len(self.raw))
        self.layout.end = self.pos
        return self.layout

    def _message(self, type_name: str, path: str) -> None:
        if type_name not in self.definitions:
            raise LogError(
                f"no definition of message type `{type_name}`", found="none in the bag", hint="give its folder: `--msg-path DIR`"
            )
        self._refuse_endless(type_name)
        fields = [f for f in self.definitions[type_name] if f[0] != PADDING]
        if not fields and self.cdr:
            self._advance(1)  # IDL has no structure without members: ROS 2 adds one of one byte
        for name, description in fields:
            self._field(description, f"{path}.{name}" if path else name)
        self.above.pop()

    def _refuse_endless(self, type_name: str) -> None:
        """Note a type inside those above it; raises LogError where it is in itself, or there are more than a message can have."""
        self.parts += 1
        if type_name in self.above or len(self.above) > DEEPEST:
            raise LogError(
                f"message type `{type_name}` is a type that holds itself, or one in one without end",
                found=" in ".join([type_name, *self.above[::-1]][:SHOWN]),
                hint="give a definition that ends: `--msg-path DIR`",
            )
        if self.parts > MOST_PARTS:
            raise LogError(
                f"message type `{(self.above or [type_name])[0]}` is none that is recorded: it has too many parts",
                found=f"more than {MOST_PARTS}",
                hint="give the definitions the vehicle was built with: `--msg-path DIR`",
            )
        self.above.append(type_name)

    def _field(self, description: Any, path: str) -> None:
        kind, what = description
        if kind == Nodetype.BASE:
            self._base(what[0], path)
        elif kind == Nodetype.NAME:
            self._message(what, path)
        else:
            inner, length = what
            self._row(inner, length if kind == Nodetype.ARRAY else self._length(), path)

    def _base(self, base: str, path: str) -> None:
        if base == "string":
            self.layout.texts[path] = (self._text(),)
            return
        dtype = self._dtype(base)
        self._align(dtype.itemsize)
        self.layout.leaves[path] = Leaf(self.pos, dtype)
        self._advance(dtype.itemsize)

    def _row(self, inner: Any, count: int, path: str) -> None:
        kind, what = inner
        if kind == Nodetype.NAME or what[0] == "string":
            if count > min(len(self.raw), MOST_PARTS):
                raise IndexError(count)
            begin = self.pos
            if kind == Nodetype.NAME:
                for i in range(count):
                    self._message(what, f"{path}[{i}]")
            else:
                self.layout.texts[path] = tuple(self._text() for _ in range(count))
            self.layout.ranges[path] = (begin, self.pos)
            return
        dtype = self._dtype(what[0])
        if count:
            self._align(dtype.itemsize)
        self.layout.leaves[path] = Leaf(self.pos, dtype, count)
        self._advance(count * dtype.itemsize)

    def _text(self) -> str:
        length = self._length()
        begin = self.pos
        self._advance(length)
        return self.raw[begin : self.pos].rstrip(b"\x00").decode("utf-8", errors="replace")

    def _length(self) -> int:
        self._align(4)
        begin = self.pos
        self._advance(4)
        self.layout.guards.append((begin, self.pos))
        return int.from_bytes(self.raw[begin : self.pos], "big" if self.order == ">" else "little")

    def _align(self, size: int) -> None:
        if self.cdr:
            self.pos += -(self.pos - self.start) % size

    def _advance(self, size: int) -> None:
        self.pos += size
        if self.pos > len(self.raw):
            raise IndexError(self.pos)

    def _dtype(self, base: str) -> np.dtype[Any]:
        if base not in DTYPES:
            raise LogError(f"fields of type `{base}` are not read", found=base, hint="map another topic")
        return np.dtype(self.order + DTYPES[base])


_STEP = re.compile(r"^(?P<base>.*)\[(?P<key>[^\[\]]+)\]$")


def numbers_at(layout: Layout, path: str) -> list[tuple[int, np.dtype[Any]]]:
    """Return offset and type of the number at a path, or of the four numbers of a quaternion.

    `a.b[2]` is an element by index, `position[rudder]` an element by its name in the field `name` of the same message. An element
    beyond the end gives an empty list. Raises MappingError with the near paths where there is no such field.
    """
    leaf = layout.leaves.get(path)
    if leaf is not None and leaf.count is None:
        return [(leaf.offset, leaf.dtype)]
    four = [layout.leaves.get(f"{path}.{part}" if path else part) for part in QUATERNION]
    if all(four):
        return [(q.offset, q.dtype) for q in four if q is not None]
    match = _STEP.match(path)
    if match is None or match["base"] not in layout.leaves:
        raise _no_field(layout, path)
    row = layout.leaves[match["base"]]
    index = _index(layout, match["base"], match["key"])
    if row.count is None or index >= row.count:
        return []
    return [(row.offset + index * row.dtype.itemsize, row.dtype)]


def _index(layout: Layout, base: str, key: str) -> int:
    if key.isdigit():
        return int(key)
    path, names = _names_of_elements(layout, base)
    if key not in names:
        raise MappingError(
            f"`{base}` has no element named {key!r}", found=", ".join(names) or "no names beside it", hint=near(key, names)
        )
    layout.guards.append(layout.ranges[path])
    return names.index(key)


def _no_field(layout: Layout, path: str) -> MappingError:
    known = [p if leaf.count is None else f"{p}[0]" for p, leaf in layout.leaves.items()]
    return MappingError(f"the message has no number at `{path}`", found=few_of(known), hint=near(path, known))


def types_in(fields: Sequence[tuple[str, Any]]) -> list[str]:
    """Return the message types of the fields of a type."""
    inner = (of if of[0] == Nodetype.NAME or of[0] == Nodetype.BASE else of[1][0] for _, of in fields)
    return [name for kind, name in inner if kind == Nodetype.NAME]


class Decoder:
    """Decode selected fields of many messages of one type."""

    def __init__(self, definitions: Definitions, type_name: str, *, cdr: bool) -> None:
        self.definitions = definitions
        self.type_name = type_name
        self.cdr = cdr

    def layout(self, raw: bytes) -> Layout:
        """Return the layout of one message; raises LogError where the definition does not fit."""
        return Walker(self.definitions, raw, cdr=self.cdr).walk(self.type_name)

    def first_values(self, raw: bytes) -> dict[str, Any]:
        """Return every number of one message by path; of an array at most eight elements."""
        layout = self.layout(raw)
        found: dict[str, Any] = {}
        for path, leaf in layout.leaves.items():
            if leaf.count is None:
                found[path] = np.frombuffer(raw, leaf.dtype, 1, leaf.offset)[0].item()
                continue
            _, names = _names_of_elements(layout, path)
            for i, value in enumerate(np.frombuffer(raw, leaf.dtype, leaf.count, leaf.offset)[:8]):
                found[f"{path}[{names[i] if i < len(names) else i}]"] = value.item()
        return found

    def decode(self, payloads: Sequence[bytes], paths: Sequence[str]) -> Columns:
        """Return for each path the numbers of all messages, and a mask of the messages that the definition fits."""
        lengths = np.fromiter(map(len, payloads), dtype=np.int64, count=len(payloads))
        good = np.ones(len(payloads), dtype=np.bool_)
        out = [np.full((len(payloads), 1), np.nan) for _ in paths]
        for length in np.unique(lengths):
            rows = np.flatnonzero(lengths == length)
            block = np.frombuffer(b"".join([payloads[i] for i in rows.tolist()]), dtype=np.uint8).reshape(rows.size, int(length))
            self._decode_block(block, rows, paths, out, good)
        return out, good

    def _decode_block(
        self,
        block: npt.NDArray[np.uint8],
        rows: npt.NDArray[np.intp],
        paths: Sequence[str],
        out: list[npt.NDArray[Any]],
        good: npt.NDArray[np.bool_],
    ) -> None:
        tried = 0
        while rows.size:
            try:
                layout = self.layout(block[0].tobytes())
            except LogError:
                good[rows[0]] = False
                block, rows = block[1:], rows[1:]
                continue
            places = [numbers_at(layout, p) for p in paths]
            same = np.ones(rows.size, dtype=bool)
            same[1:] = tried < ROWS_APART
            for begin, end in layout.guards if tried < ROWS_APART else ():
                same &= (block[:, begin:end] == block[0, begin:end]).all(axis=1)
            _take(block[same], rows[same], places, out)
            block, rows = (block[~same], rows[~same]) if tried < ROWS_APART else (block[1:], rows[1:])
            tried += 1


def _take(
    block: npt.NDArray[np.uint8],
    rows: npt.NDArray[np.intp],
    places: Sequence[Sequence[tuple[int, np.dtype[Any]]]],
    out: list[npt.NDArray[Any]],
) -> None:
    for k, place in enumerate(places):
        if len(place) > out[k].shape[1]:
            out[k] = np.repeat(out[k], len(place), axis=1)
        for j, (offset, dtype) in enumerate(place):
            column = np.ascontiguousarray(block[:, offset : offset + dtype.itemsize]).view(dtype)[:, 0]
            out[k][rows, j] = column


def _names_of_elements(layout: Layout, base: str) -> tuple[str, tuple[str, ...]]:
    """Return the path of the texts that name the elements of an array, and these texts; empty where there are none."""
    parent = base.rpartition(".")[0]
    paths = (f"{parent}.{name}" if parent else name for name in ("name", "names"))
    return next(((path, layout.texts[path]) for path in paths if path in layout.texts), ("", ()))


def as_floats(values: npt.NDArray[Any]) -> FloatArray:
    """Return values as float64, (n, 1) as (n,) and (n, 4) as (n, 4)."""
    floats = np.asarray(values, dtype=np.float64)
    return floats[:, 0] if floats.shape[1] == 1 else floats


def _misfit(type_name: str, needed: int, found: int) -> LogError:
    return LogError(
        f"the definition of `{type_name}` does not fit its messages",
        found=f"a message of {found} bytes where the definition ends at {needed}",
        hint="give the definitions the vehicle was built with: `--msg-path DIR`",
    )
