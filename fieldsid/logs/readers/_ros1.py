"""ROS 1 bags (format 2.0), read from front to back without the index: a cut-off bag gives what is left.

A record is a header (u32 length, then u32 length + `name=value` fields) and data (u32 length, then bytes).
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path

from fieldsid.errors import LogError
from fieldsid.logs.readers._packets import Catch, Link, Slot
from fieldsid.logs.readers._unpack import unpacked

MAGIC = b"#ROSBAG V"
MESSAGE_HEADER = 38
"""Bytes of the header of a message: op, conn and time, each with its length."""

DAMAGE = (KeyError, struct.error, UnicodeDecodeError)
"""What a record with a field that is missing, too short or no text raises."""

_U32 = struct.Struct("<I")
_STAMP = struct.Struct("<II")
Bytes = bytes | mmap.mmap


def scan(path: Path, catch: Catch) -> None:
    """Read every record of a bag into `catch`; raises LogError for a version or an encryption it does not know."""
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        first = data.find(b"\n", 0, 32) + 1
        if data[:first] != b"#ROSBAG V2.0\n":
            raise LogError(
                f"`{path}` is a bag of another version",
                found=repr(data[: max(first, 16)]),
                hint="convert it with `rosbag migrate`",
            )
        _Records(catch).run(data, first, len(data), inner=False)


class _Records:
    """The records of a file, and of the chunks inside it."""

    def __init__(self, catch: Catch) -> None:
        self.catch = catch
        self.slots: dict[int, Slot | None] = {}
        self.shape: tuple[int, int, int] | None = None

    def run(self, data: Bytes, pos: int, end: int, *, inner: bool) -> None:
        take_u32 = _U32.unpack_from
        while pos < end:
            if pos + 4 > end:
                return self._cut("inside a record", end, inner=inner)
            head = pos + 4
            (size,) = take_u32(data, pos)
            body = head + size + 4
            if body > end:
                return self._cut("inside a record's header", end, inner=inner)
            (length,) = take_u32(data, head + size)
            pos = body + length
            if pos > end:
                self._last_chunk(data, head, size, body, end)
                return self._cut("inside a record", end, inner=inner)
            self._record(data, head, size, body, length)
        return None

    def _record(self, data: Bytes, head: int, size: int, body: int, length: int) -> None:
        fast = self._message(data, head, size)
        if fast is None:
            self._slow(data, head, size, body, length)
            return
        conn, stamp = fast
        slot = self.slots.get(conn)
        if slot is not None:
            slot.take(stamp, bytes(data[body : body + length]))

    def _message(self, data: Bytes, head: int, size: int) -> tuple[int, int] | None:
        """Connection and stamp of a message record laid out like the one before it; None for any other."""
        if self.shape is None:
            return None
        op, conn, time = self.shape
        if (
            size != MESSAGE_HEADER
            or data[head + op : head + op + 4] != b"op=\x02"
            or data[head + conn : head + conn + 5] != b"conn="
        ):
            return None
        sec, nanosec = _STAMP.unpack_from(data, head + time + 5)
        return _U32.unpack_from(data, head + conn + 5)[0], sec * 1_000_000_000 + nanosec

    def _slow(self, data: Bytes, head: int, size: int, body: int, length: int) -> None:
        try:
            self._any(data, head, size, body, length)
        except DAMAGE:
            self.catch.damaged("a record", head)

    def _any(self, data: Bytes, head: int, size: int, body: int, length: int) -> None:
        fields = _fields(data, head, size)
        op = fields.get(b"op", (b"", 0))[0]
        if op == b"\x02":
            self._first_message(data, fields, head, size, body, length)
        elif op == b"\x05":
            self._chunk(fields, bytes(data[body : body + length]), body)
        elif op == b"\x07":
            self._connection(fields, data, body, length)
        elif op == b"\x03" and fields.get(b"encryptor", (b"", 0))[0]:
            raise LogError("the bag is encrypted", found=repr(fields[b"encryptor"][0]), hint="decrypt it with `rosbag decrypt`")

    def _first_message(
        self, data: Bytes, fields: dict[bytes, tuple[bytes, int]], head: int, size: int, body: int, length: int
    ) -> None:
        if size == MESSAGE_HEADER:
            self.shape = (fields[b"op"][1] - head - 3, fields[b"conn"][1] - head - 5, fields[b"time"][1] - head - 5)
        slot = self.slots.get(_U32.unpack(fields[b"conn"][0])[0])
        if slot is not None:
            sec, nanosec = _STAMP.unpack(fields[b"time"][0])
            slot.take(sec * 1_000_000_000 + nanosec, bytes(data[body : body + length]))

    def _connection(self, fields: dict[bytes, tuple[bytes, int]], data: Bytes, body: int, length: int) -> None:
        number = _U32.unpack(fields[b"conn"][0])[0]
        if number in self.slots:
            return
        about = {k: v for k, (v, _) in _fields(data, body, length).items()}
        name = about[b"type"].decode()
        package, _, short = name.rpartition("/")
        topic = (about.get(b"topic") or fields[b"topic"][0]).decode()
        definition = about[b"message_definition"].decode("utf-8", errors="replace")
        self.slots[number] = self.catch.link(Link(topic, f"{package}/msg/{short}", "ros1", definition, "msg"))

    def _chunk(self, fields: dict[bytes, tuple[bytes, int]], data: bytes, position: int) -> None:
        compression = fields.get(b"compression", (b"none", 0))[0].decode()
        size = _U32.unpack(fields[b"size"][0])[0]
        plain = unpacked(data, compression)
        if plain is None:
            self.catch.damaged("a compressed chunk", position)
            return
        self.run(plain, 0, len(plain), inner=True)
        if len(plain) < size:
            self.catch.damaged("the end of a compressed chunk", position)

    def _last_chunk(self, data: Bytes, head: int, size: int, body: int, end: int) -> None:
        """Take what is left of a chunk that the end of the file cuts."""
        if _fields(data, head, size).get(b"op", (b"", 0))[0] == b"\x05":
            self._slow(data, head, size, body, end - body)

    def _cut(self, where: str, size: int, *, inner: bool) -> None:
        if not inner:
            self.catch.truncated(where, size)


def _fields(data: Bytes, pos: int, size: int) -> dict[bytes, tuple[bytes, int]]:
    """Return the fields of a header: name to value and the value's position."""
    found: dict[bytes, tuple[bytes, int]] = {}
    end = pos + size
    while pos + 4 <= end:
        (length,) = _U32.unpack_from(data, pos)
        name, _, value = bytes(data[pos + 4 : pos + 4 + length]).partition(b"=")
        found[name] = (value, pos + 4 + len(name) + 1)
        pos += 4 + length
    return found
