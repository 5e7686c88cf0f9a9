"""ROS 1 bags (format 2.0), read from front to back.

Over rosbags: packets 3 to 4 times as fast (tests/benchmarks/bag_reading.py), and a bag that is cut off, has no index or
damaged records gives what is left. Another version or compression, and encryption, are left to rosbags.

A record is a header (u32 length, then u32 length + `name=value` fields) and data (u32 length, then bytes); a chunk holds
more records. The index behind the data repeats the connections and counts the messages; it is used where it is there.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from fieldsid.logs.readers.bags.containers.damage import Bytes, forget, mapped, resumed
from fieldsid.logs.readers.bags.containers.decompress import unpacked
from fieldsid.logs.readers.bags.packets import LAST_NS, ROS1, Collector, Connection, TopicPackets, UnknownFormError

MAGIC = b"#ROSBAG V"
FIRST_LINE = b"#ROSBAG V2.0\n"
MESSAGE, BAG, INDEX, CHUNK, CHUNK_INFO, CONNECTION = b"\x02", b"\x03", b"\x04", b"\x05", b"\x06", b"\x07"
NEEDED: Mapping[bytes, frozenset[bytes]] = MappingProxyType({
    MESSAGE: frozenset({b"conn", b"time"}), BAG: frozenset({b"index_pos"}), INDEX: frozenset({b"conn", b"count"}),
    CHUNK: frozenset({b"compression", b"size"}), CHUNK_INFO: frozenset({b"chunk_pos", b"count"}),
    CONNECTION: frozenset({b"conn", b"topic"}),
})  # fmt: skip
"""The fields without which a record is none of its kind."""
MESSAGE_HEADER = 38
"""Bytes of the header of a message: op, conn and time, each with its length."""
LONGEST_HEADER = 4096
"""Bytes of a header above which it is taken for damage: its longest field is a topic's name."""
BEFORE_OP = 128
"""Bytes of other fields that may stand before the op of a record."""

_U32 = struct.Struct("<I")
_STAMP, _ENTRY = struct.Struct("<II"), struct.Struct("<III")
_OP = re.compile(rb"\x04\x00\x00\x00op=[\x02-\x07]")
_OP_MESSAGE, _CONN = b"op=" + MESSAGE, b"conn="
_SIZE_OF_MESSAGE = _U32.pack(MESSAGE_HEADER)

Fields = Mapping[bytes, bytes]


def scan(path: Path, collector: Collector) -> None:
    """Read every record of a bag into `collector`; raises UnknownFormError for a version or an encryption it does not know."""
    with mapped(path) as data:
        first = data.find(b"\n", 0, 32) + 1
        if data[:first] != FIRST_LINE:
            raise UnknownFormError(
                f"`{path}` is a bag of another version",
                found=repr(data[: max(first, 16)]),
                hint="convert it with `rosbag migrate`",
            )
        records = _Records(collector)
        records.index(data, first)
        records.run(data, first, len(data), _Place())


@dataclass(frozen=True, slots=True)
class _Place:
    """Where the bytes stand that are being read: in the chunk at byte `chunk`, or in none (0)."""

    chunk: int = 0
    is_packed: bool = False
    is_cut: bool = False


@dataclass(frozen=True, slots=True)
class _Shape:
    """Where the fields of a message's header stand, as in the message before; `conn` and `time` are those of the values."""

    op: int
    conn: int
    time: int


class _Records:
    """The records of a file, and of the chunks inside it."""

    def __init__(self, collector: Collector) -> None:
        self.collector = collector
        self.topics: dict[int, str] = {}
        self.by_number: dict[int, TopicPackets | None] = {}
        self.shape: _Shape | None = None
        self.last: TopicPackets | None = None
        self.near = (0, LAST_NS)

    def index(self, data: Bytes, pos: int) -> None:
        """Take connections and counts from the index, which a whole bag ends in."""
        if self._end_of_sound(data, pos, len(data)) is None:
            return
        place = _header(data, pos).get(b"index_pos", b"")
        at = int.from_bytes(place, "little") if len(place) == 8 else 0
        while pos < at < len(data) and (stop := self._end_of_sound(data, at, len(data))) is not None:
            fields = _header(data, at)
            if fields[b"op"] == CONNECTION:
                self._connection(fields, data, at, stop)
            elif fields[b"op"] == CHUNK_INFO:
                self._counts(data, at, stop)
            at = stop

    def run(self, data: Bytes, pos: int, end: int, place: _Place) -> None:
        """Read the records from `pos` to `end`, and on behind damage."""
        take_u32, take_stamp, by_number = _U32.unpack_from, _STAMP.unpack_from, self.by_number
        self.last = None
        while pos < end:
            head = pos + 4
            shape = self.shape
            if (
                shape is not None
                and head + MESSAGE_HEADER + 4 <= end
                and data[pos:head] == _SIZE_OF_MESSAGE
                and data[head + shape.op : head + shape.op + 4] == _OP_MESSAGE
                and data[head + shape.conn - 5 : head + shape.conn] == _CONN
            ):
                (number,) = take_u32(data, head + shape.conn)
                stop = head + MESSAGE_HEADER + 4 + take_u32(data, head + MESSAGE_HEADER)[0]
                if stop <= end and number in by_number:
                    packets = self.last = by_number[number]
                    if packets is not None:
                        sec, nanosec = take_stamp(data, head + shape.time)
                        packets.stamps.append(sec * 1_000_000_000 + nanosec)
                        packets.payloads.append(bytes(data[head + MESSAGE_HEADER + 4 : stop]))
                    pos = stop
                    continue
            pos = self._behind_other(data, pos, end, place)

    def _behind_other(self, data: Bytes, pos: int, end: int, place: _Place) -> int:
        """Take a record that is laid out otherwise than the message before it; return where the next one starts."""
        stop = self._end_of_sound(data, pos, end)
        if stop is None:
            return self._behind_damage(data, pos, end, place)
        fields = _header(data, pos)
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
            raise UnknownFormError(
                "the bag is encrypted", found=repr(fields[b"encryptor"]), hint="decrypt it with `rosbag decrypt`"
            )
        return stop

    def _behind_damage(self, data: Bytes, pos: int, end: int, place: _Place) -> int:
        """Return where records go on; leave out the message before damage, which may begin inside that one."""
        self.near = self.collector.stamps_near(self.last)
        go_on = resumed(_candidates(data, pos + 1, end), lambda at: self._end_of_near(data, at, end), end)
        if go_on is None and (not place.chunk or place.is_cut) and self._is_cut(data, pos, end):
            if not place.chunk:
                self.collector.truncated("inside a record", end)
            return end
        if self.last is not None:
            self.last.leave_out_last()
            self.last = None
        stop = end if go_on is None else go_on
        if place.is_packed:
            self.collector.damaged_at(f"{stop - pos} bytes of the compressed chunk", place.chunk)
        else:
            self.collector.damaged_at(f"{stop - pos} bytes", pos)
        return stop

    def _is_cut(self, data: Bytes, pos: int, end: int) -> bool:
        """Whether the last record is cut by the end of the file; what is left of a chunk is taken."""
        if pos + 4 > end:
            return True
        (size,) = _U32.unpack_from(data, pos)
        if size > LONGEST_HEADER or pos + 8 + size > end:
            return bool(size <= LONGEST_HEADER)
        fields = _header(data, pos)
        op = fields.get(b"op", b"")
        whole = pos + 8 + size + _U32.unpack_from(data, pos + 4 + size)[0]
        if op not in NEEDED or not NEEDED[op] <= fields.keys() or whole <= end:
            return False
        if op == CHUNK:
            self._chunk(fields, data, pos, end, whole)
        return True

    def _end_of_sound(self, data: Bytes, pos: int, end: int) -> int | None:
        """Return the end of the record at `pos`, or None where none can be."""
        if pos + 8 > end:
            return None
        (size,) = _U32.unpack_from(data, pos)
        if not 8 <= size <= LONGEST_HEADER or pos + 8 + size > end:
            return None
        fields = _header(data, pos)
        op = fields.get(b"op", b"")
        stop: int = pos + 8 + size + _U32.unpack_from(data, pos + 4 + size)[0]
        if op not in NEEDED or not NEEDED[op] <= fields.keys() or stop > end:
            return None
        if op == MESSAGE and (len(fields[b"time"]) != 8 or _number(fields) not in self.by_number):
            return None
        return stop

    def _end_of_near(self, data: Bytes, pos: int, end: int) -> int | None:
        """Return the end of the record at `pos` behind damage: a message there has a stamp near the last one."""
        stop = self._end_of_sound(data, pos, end)
        fields = {} if stop is None else _header(data, pos)
        low, high = self.near
        return None if fields.get(b"op") == MESSAGE and not low <= _stamp(fields) <= high else stop

    def _message(self, fields: Fields, data: Bytes, pos: int, stop: int) -> None:
        """Take a message, and where its fields stand if its header holds only those that each has."""
        (size,) = _U32.unpack_from(data, pos)
        head = bytes(data[pos + 4 : pos + 4 + size])
        if size == MESSAGE_HEADER:
            self.shape = _Shape(head.index(_OP_MESSAGE), head.index(_CONN) + 5, head.index(b"time=") + 5)
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
        self.topics[number] = topic
        self.by_number[number] = self.collector.connect(Connection(topic, f"{package}/msg/{short}", ROS1, definition, "msg"))

    def _counts(self, data: Bytes, pos: int, stop: int) -> None:
        """Take the count of messages that a chunk holds of each connection."""
        (size,) = _U32.unpack_from(data, pos)
        for at in range(pos + 8 + size, stop - 7, _STAMP.size):
            number, count = _STAMP.unpack_from(data, at)
            if number in self.topics:
                self.collector.expect(self.topics[number], count)

    def _chunk(self, fields: Fields, data: Bytes, pos: int, stop: int, whole: int) -> None:
        """Read the records of a chunk that ends at `stop`, in a file that is not cut at `whole`."""
        body = pos + 8 + _U32.unpack_from(data, pos)[0]
        compression = fields[b"compression"].decode(errors="replace")
        size = int.from_bytes(fields[b"size"], "little")
        self.collector.has_read(stop - pos)
        forget(data, pos)
        place = _Place(pos, is_packed=compression != "none", is_cut=stop < whole)
        got = stop - body
        if place.is_packed:
            plain = unpacked(bytes(data[body:stop]), compression, size)
            if plain is None or (not place.is_cut and len(plain) != size):
                self.collector.damaged_at(f"a compressed chunk of {size} bytes", pos)
                return
            self.collector.unpacked.add(len(plain))
            counts = self.collector.counts()
            self.run(plain, 0, len(plain), place)
            if not place.is_cut and not self._agrees_with_index(data, stop, counts):
                self.collector.leave_out_from(counts)
                self.collector.damaged_at(f"a compressed chunk of {size} bytes", pos)
            got = len(plain)
        else:
            self.run(data, body, stop, place)
        if place.is_cut:
            self.collector.cut_chunk(pos, got, size)

    def _agrees_with_index(self, data: Bytes, pos: int, counts: Mapping[str, int]) -> bool:
        """Whether the messages of a chunk have the stamps that the index records behind it state; true without any.

        Damaged data may unpack without an error. The stamps are the numbers that differ in every record, so that damage
        shows in them.
        """
        stated: dict[str, list[int]] = {}
        while (stop := self._end_of_sound(data, pos, len(data))) is not None and _header(data, pos)[b"op"] == INDEX:
            start = pos + 8 + _U32.unpack_from(data, pos)[0]
            entries = _ENTRY.iter_unpack(data[start : stop - (stop - start) % _ENTRY.size])
            topic = self.topics.get(_number(_header(data, pos)), "")
            stated.setdefault(topic, []).extend(sec * 1_000_000_000 + nanosec for sec, nanosec, _ in entries)
            pos = stop
        found = self.collector.stamps_since(counts)
        return all(sorted(found[topic]) == sorted(stamps) for topic, stamps in stated.items() if topic in found)


def _candidates(data: Bytes, pos: int, end: int) -> Iterator[int]:
    """Yield the places from which a header may start: its length fits, and an op is among its fields."""
    for match in _OP.finditer(data, pos, end):
        for start in range(max(pos, match.start() - BEFORE_OP), match.start() - 3):
            (size,) = _U32.unpack_from(data, start)
            if match.end() - start - 4 <= size <= LONGEST_HEADER:
                yield start


def _header(data: Bytes, pos: int) -> Fields:
    """Return the fields of the header of the record at `pos`; none where they do not fill it."""
    (size,) = _U32.unpack_from(data, pos)
    return _fields(data, pos + 4, pos + 4 + size) or {}


def _fields(data: Bytes, pos: int, end: int) -> Fields | None:
    """Return the values by name that stand from `pos` to `end`, or None where their lengths do not fit that."""
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
