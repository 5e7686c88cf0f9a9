"""Bags and messages by rosbags' own code: for whatever the readers of this room do not know, one object per message."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag1 import ReaderError as Ros1ReaderError
from rosbags.rosbag2 import Reader as Ros2Reader
from rosbags.rosbag2 import ReaderError as Ros2ReaderError
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_typestore

from fieldsid.errors import LogError
from fieldsid.logs.readers.bags.messages.message_layout import (
    NAME,
    PADDING,
    Columns,
    Definitions,
    Layout,
    Leaf,
    first_values,
    numbers_at,
    types_in,
)
from fieldsid.logs.readers.bags.packets import ROS1, Collector, Connection, UnknownFormError

FAILURES = (
    Ros1ReaderError, Ros2ReaderError, SerdeError, TypesysError, AssertionError, KeyError, ValueError, IndexError, OSError,
    OverflowError, MemoryError,
)  # fmt: skip
"""What rosbags raises on a file it cannot read; it asserts, indexes and believes any length where a file breaks its rules."""
_LANGUAGES = {MessageDefinitionFormat.MSG: "msg", MessageDefinitionFormat.IDL: "idl"}
_FLOAT = np.dtype("<f8")


def collect(path: Path, collector: Collector, because: UnknownFormError) -> None:
    """Read every message of one file into `collector`; raises LogError when rosbags cannot read it either."""
    is_ros1 = path.suffix == ".bag"
    try:
        with (Ros1Reader if is_ros1 else Ros2Reader)(path) as reader:
            packets = {c.id: collector.connect(_connection(c, is_ros1=is_ros1)) for c in reader.connections}
            wanted = [c for c in reader.connections if packets[c.id] is not None]
            for connection, stamp, payload in reader.messages(wanted) if wanted else ():
                place: Any = packets[connection.id]
                place.stamps.append(stamp)
                place.payloads.append(bytes(payload))
                collector.has_read(len(payload))
    except FAILURES as error:
        raise LogError(because.what, found=f"{because.found}; rosbags: {error}", hint=because.hint) from error


def _connection(found: Any, *, is_ros1: bool) -> Connection:
    serialization = ROS1 if is_ros1 else found.ext.serialization_format
    language: Any = _LANGUAGES.get(found.msgdef.format, "")
    return Connection(found.topic, found.msgtype, serialization, found.msgdef.data, language)


class ObjectDecoder:
    """Decodes chosen fields of many messages of one type, through the objects that rosbags makes of them.

    The numbers of a message are put into one row of float64, so that paths and layouts are those of `message_layout`.
    """

    def __init__(self, definitions: Definitions, type_name: str, *, cdr: bool) -> None:
        self.definitions = definitions
        self.type_name = type_name
        self.cdr = cdr
        self.store = get_typestore(Stores.EMPTY)
        self.store.register({name: ([], definitions[name]) for name in _reached(definitions, type_name)})  # type: ignore[misc]

    def layout(self, raw: bytes) -> Layout:
        """Return the layout of one message; raises LogError where rosbags cannot decode it."""
        return self._row(raw)[0]

    def first_values(self, raw: bytes) -> dict[str, Any]:
        """Return every number of one message by path."""
        layout, row = self._row(raw)
        return first_values(layout, row.tobytes())

    def decode(self, payloads: Sequence[bytes], paths: Sequence[str]) -> Columns:
        """Return for each path the numbers of all messages, and which messages the definition fits."""
        good = np.ones(len(payloads), dtype=np.bool_)
        rows: list[list[list[float]]] = []
        for i, payload in enumerate(payloads):
            try:
                layout, row = self._row(payload)
            except LogError:
                good[i] = False
                rows.append([[] for _ in paths])
                continue
            rows.append([[row[offset // 8] for offset, _ in numbers_at(layout, p)] for p in paths])
        return [_filled([r[k] for r in rows]) for k in range(len(paths))], good

    def _row(self, raw: bytes) -> tuple[Layout, npt.NDArray[np.float64]]:
        deserialize = self.store.deserialize_cdr if self.cdr else self.store.deserialize_ros1
        try:
            message = deserialize(raw, self.type_name)
        except FAILURES as error:
            raise LogError(f"a message of `{self.type_name}` cannot be decoded", found=str(error)) from error
        layout, numbers = Layout(), list[float]()
        for path, value in self._parts(message, self.type_name, ""):
            if isinstance(value, str):
                layout.texts[path] = (value,)
            elif isinstance(value, list):
                layout.texts[path] = tuple(value)
            else:
                row = np.atleast_1d(value)
                layout.leaves[path] = Leaf(8 * len(numbers), _FLOAT, row.size if isinstance(value, np.ndarray) else None)
                numbers += row.astype(float).tolist()
        return layout, np.array(numbers, dtype=np.float64)

    def _parts(self, message: Any, type_name: str, path: str) -> Iterator[tuple[str, Any]]:
        """Yield the paths of a message with a number, a row of numbers, a text or a list of texts."""
        for (name, (kind, what)), item in zip(self.definitions[type_name], dataclasses.fields(message), strict=False):
            if name == PADDING:
                continue
            value = getattr(message, item.name)
            place = f"{path}.{name}" if path else name
            if kind == NAME:
                yield from self._parts(value, what, place)
            elif kind > NAME and what[0][0] == NAME:
                for i, part in enumerate(value):
                    yield from self._parts(part, what[0][1], f"{place}[{i}]")
            else:
                yield place, value


def _filled(rows: list[list[float]]) -> npt.NDArray[Any]:
    width = max(1, *map(len, rows))
    return np.array([[*row, *[np.nan] * (width - len(row))] for row in rows])


def _reached(definitions: Definitions, type_name: str) -> set[str]:
    """Return the types a message is made of, itself among them."""
    reached: set[str] = set()
    ahead = [type_name]
    while ahead:
        name = ahead.pop()
        if name not in reached and name in definitions:
            reached.add(name)
            ahead += types_in(definitions[name])
    return reached
