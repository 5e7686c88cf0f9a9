"""Read ROS 1 bags (format 2.0) from front to back.

Over rosbags: packets read 3 to 4 times as fast (tests/benchmarks/bag_reading.py), and the readable records are
returned of a bag that is cut off, has no index or has damaged records.

A record is a header (u32 length, then u32 length + `name=value` fields) and data (u32 length, then bytes); a chunk contains
further records. The index after the data repeats the connections and counts the messages; it is used if it exists.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from fieldsid.errors import LogError
from fieldsid.logs.readers.bags.containers.damage import Bytes, ChunkHead, Place, Records, mapped
from fieldsid.logs.readers.bags.packets import ROS1, Collector, Connection

MAGIC = b"#ROSBAG V"
FIRST_LINE = b"#ROSBAG V2.0\n"
MESSAGE, BAG, INDEX, CHUNK, CHUNK_INFO, CONNECTION = b"\x02", b"\x03", b"\x04", b"\x05", b"\x06", b"\x07"
NEEDED: Mapping[bytes, frozenset[bytes]] = MappingProxyType({
    MESSAGE: frozenset({b"conn", b"time"}), BAG: frozenset({b"index_pos"}), INDEX: frozenset({b"conn", b"count"}),
    CHUNK: frozenset({b"compression", b"size"}), CHUNK_INFO: frozenset({b"chunk_pos", b"count"}),
    CONNECTION: frozenset({b"conn", b"topic"}),
})  # fmt: skip
"""The required fields of each kind of record."""
MESSAGE_HEADER = sum(map(len, (b"....op=.", b"....conn=....", b"....time=........")))
"""Bytes of the header of a message: op, conn and time, each after its length."""
LONGEST_HEADER = 4096
"""Largest number of bytes of a header, whose longest field is the name of a topic; a longer one is damaged."""
BEFORE_OP = 128
"""Largest number of bytes of other fields before the op of a record."""

_U32 = struct.Struct("<I")
_STAMP, _ENTRY = struct.Struct("<II"), struct.Struct("<III")
_OP = re.compile(rb"\x04\x00\x00\x00op=[\x02-\x07]")
_OP_MESSAGE, _CONN = b"op=" + MESSAGE, b"conn="
_SIZE_OF_MESSAGE = _U32.pack(MESSAGE_HEADER)

Fields = Mapping[bytes, bytes]


def scan(path: Path, collector: Collector) -> None:
    """Read every record of a bag into `collector`; raises LogError for a version or an encryption it does not know."""
    with mapped(path) as data:
        first = data.find(b"\n", 0, 32) + 1
        if data[:first] != FIRST_LINE:
            raise LogError(
                f"`{path}` is a bag of another version",
                found=repr(data[: max(first, 16)]),
                hint="convert it with `rosbag migrate`",
            )
        records = _Records(collector)
        records.index(data, first)
        records.run(data, first, len(data), Place())


Shape = tuple[int, int, int]
"""Offsets of the op, and of the values of conn and time, in the header of a message."""


class _Records(Records):
    """The records of a ROS 1 bag, and of the chunks inside it."""

    cut_where = "inside a record"

    def __init__(self, collector: Collector) -> None:
        super().__init__(collector)
        self.shape: Shape | None = None

    def index(self, data: Bytes, pos: int) -> None:
        """Read connections and counts from the index at the end of a complete bag."""
        first, _ = self._valid(data, pos, len(data)) or ({}, 0)
        place = first.get(b"index_pos", b"")
        at = int.from_bytes(place, "little") if len(place) == 8 else 0
        while pos < at < len(data) and (found := self._valid(data, at, len(data))) is not None:
            fields, stop = found
            if fields[b"op"] == CONNECTION:
                self._connection(fields, data, at, stop)
            elif fields[b"op"] == CHUNK_INFO:
                self.expect(data[at + 8 + _U32.unpack_from(data, at)[0] : stop], _STAMP)
            at = stop

    def run(self, data: Bytes, pos: int, end: int, place: Place) -> None:
        """Read the records from `pos` to `end`, continuing after damaged places."""
        take_u32, take_stamp, by_number = _U32.unpack_from, _STAMP.unpack_from, self.by_number
        self.last = None
        while pos < end:
            head = pos + 4
            op, conn, time = self.shape or (0, 0, 0)
            if (
                self.shape is not None
                and head + MESSAGE_HEADER + 4 <= end
                and data[pos:head] == _SIZE_OF_MESSAGE
                and data[head + op : head + op + 4] == _OP_MESSAGE
                and data[head + conn - 5 : head + conn] == _CONN
            ):
                (number,) = take_u32(data, head + conn)
                stop = head + MESSAGE_HEADER + 4 + take_u32(data, head + MESSAGE_HEADER)[0]
                if stop <= end and number in by_number:
                    packets = self.last = by_number[number]
                    if packets is not None:
                        sec, nanosec = take_stamp(data, head + time)
                        packets.stamps.append(sec * 1_000_000_000 + nanosec)
                        packets.payloads.append(bytes(data[head + MESSAGE_HEADER + 4 : stop]))
                    pos = stop
                    continue
            pos = self._end_of_other(data, pos, end, place)

    def _end_of_other(self, data: Bytes, pos: int, end: int, place: Place) -> int:
        """Read a record with another layout than the message before it; return the offset of the next record."""
        found = self._valid(data, pos, end)
        if found is None:
            return self.behind_damage(data, pos, end, place)
        fields, stop = found
        op = fields[b"op"]
        if op == MESSAGE:
            self._message(fields, data, pos, stop)
            return stop
        if op == CHUNK and not place.chunk:
            self._chunk(fields, data, pos, stop, stop)
            return stop
        self.last = None
        if op == CONNECTION:
            self._connection(fields, data, pos, stop)
        elif op == BAG and fields.get(b"encryptor"):
            raise LogError("the bag is encrypted", found=repr(fields[b"encryptor"]), hint="decrypt it with `rosbag decrypt`")
        return stop

    def is_cut(self, data: Bytes, pos: int, end: int) -> bool:
        """Whether the record at `pos` is cut off by the end of the file; the rest of a chunk that is cut off is read."""
        if pos + 4 > end:
            return True
        (size,) = _U32.unpack_from(data, pos)
        if size > LONGEST_HEADER or pos + 8 + size > end:
            return bool(size <= LONGEST_HEADER)
        fields, full_end = _record(data, pos, end)
        if full_end <= end:
            return False
        if fields[b"op"] == CHUNK:
            self._chunk(fields, data, pos, end, full_end)
        return True

    def _valid(self, data: Bytes, pos: int, end: int) -> tuple[Fields, int] | None:
        """Return the header and the end of the record at `pos`, or None where the bytes are no valid record."""
        fields, stop = _record(data, pos, end)
        if not 0 < stop <= end:
            return None
        is_message = fields[b"op"] == MESSAGE
        return None if is_message and (len(fields[b"time"]) != 8 or _number(fields) not in self.by_number) else (fields, stop)

    def end_behind_damage(self, data: Bytes, pos: int, end: int, place: Place) -> int | None:
        """Return the end of the record at `pos`, or None where the bytes are no valid record.

        The stamp of a message must be near those read before.
        """
        fields, stop = self._valid(data, pos, end) or ({}, None)
        low, high = max(self.near[0], place.low), min(self.near[1], place.high)
        return None if fields.get(b"op") == MESSAGE and not low <= _stamp(fields) <= high else stop

    def _message(self, fields: Fields, data: Bytes, pos: int, stop: int) -> None:
        """Read a message; keep the offsets of its fields if its header has only the required ones."""
        (size,) = _U32.unpack_from(data, pos)
        head = bytes(data[pos + 4 : pos + 4 + size])
        if size == MESSAGE_HEADER:
            self.shape = head.index(_OP_MESSAGE), head.index(_CONN) + 5, head.index(b"time=") + 5
        self.last = self.by_number[_number(fields)]
        if self.last is not None:
            self.last.stamps.append(_stamp(fields))
            self.last.payloads.append(bytes(data[pos + 8 + size : stop]))

    def _connection(self, fields: Fields, data: Bytes, pos: int, stop: int) -> None:
        number = _number(fields)
        if number in self.by_number:
            return
        (size,) = _U32.unpack_from(data, pos)
        about = _fields(data, pos + 8 + size, stop) or {}
        if b"type" not in about or b"message_definition" not in about:
            self.collector.damaged_at(f"the connection of {fields[b'topic'].decode(errors='replace')}", pos)
            return
        package, _, short = about[b"type"].decode(errors="replace").rpartition("/")
        topic = (about.get(b"topic") or fields[b"topic"]).decode(errors="replace")
        definition = about[b"message_definition"].decode(errors="replace")
        self.connect(number, Connection(topic, f"{package}/msg/{short}", ROS1, definition, "msg"))

    def _chunk(self, fields: Fields, data: Bytes, pos: int, stop: int, full_end: int) -> None:
        """Read the records of a chunk that ends at `stop`; in a file that is not cut off it would end at `full_end`."""
        body = pos + 8 + _U32.unpack_from(data, pos)[0]
        compression = fields[b"compression"].decode(errors="replace")
        size = int.from_bytes(fields[b"size"], "little")
        head = ChunkHead(size, "" if compression == "none" else compression, body, f"{size} bytes")
        self.take_chunk(data, pos, stop, full_end, head)

    def stated_stamps(self, data: Bytes, pos: int) -> Iterator[tuple[int, Iterable[int]]]:
        """Yield each connection's number with its stamps in ns in the index records at `pos`."""
        while (found := self._valid(data, pos, len(data))) is not None and found[0][b"op"] == INDEX:
            fields, stop = found
            start = pos + 8 + _U32.unpack_from(data, pos)[0]
            entries = _ENTRY.iter_unpack(data[start : stop - (stop - start) % _ENTRY.size])
            yield _number(fields), (sec * 1_000_000_000 + nanosec for sec, nanosec, _ in entries)
            pos = stop

    def candidates(self, data: Bytes, pos: int, end: int) -> Iterator[int]:
        """Yield the offsets at which a record may start: the length of its header fits, and one of its fields is an op."""
        for match in _OP.finditer(data, pos, end):
            for start in range(max(pos, match.start() - BEFORE_OP), match.start() - 3):
                (size,) = _U32.unpack_from(data, start)
                if match.end() - start - 4 <= size <= LONGEST_HEADER:
                    yield start


def _record(data: Bytes, pos: int, end: int) -> tuple[Fields, int]:
    """Return the header of the record at `pos`, and the end that it states, also beyond `end`; {} and 0 where it is none."""
    (size,) = _U32.unpack_from(data, pos) if pos + 8 <= end else (0,)
    if not 8 <= size <= LONGEST_HEADER or pos + 8 + size > end:
        return {}, 0
    fields = _fields(data, pos + 4, pos + 4 + size) or {}
    op = fields.get(b"op", b"")
    if op not in NEEDED or not NEEDED[op] <= fields.keys():
        return {}, 0
    return fields, pos + 8 + size + _U32.unpack_from(data, pos + 4 + size)[0]


def _fields(data: Bytes, pos: int, end: int) -> Fields | None:
    """Return the values by name between `pos` and `end`, or None where their lengths do not fit these bounds."""
    found: dict[bytes, bytes] = {}
    while pos + 4 <= end:
        (length,) = _U32.unpack_from(data, pos)
        if pos + 4 + length > end:
            return None
        name, _, value = bytes(data[pos + 4 : pos + 4 + length]).partition(b"=")
        found[name] = value
        pos += 4 + length
    return found if pos == end else None


def _number(fields: Fields) -> int:
    return int.from_bytes(fields[b"conn"], "little")


def _stamp(fields: Fields) -> int:
    sec, nanosec = _STAMP.unpack(fields[b"time"])
    return int(sec * 1_000_000_000 + nanosec)
