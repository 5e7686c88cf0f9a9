"""Read MCAP files (mcap.dev, specification 0) from front to back.

Over rosbags: packets read 3 times as fast (tests/benchmarks/bag_reading.py), the readable records are returned of
a file that is cut off, has no footer or has damaged records, and files of other recorders than that of ROS 2 can be read.

A record is an opcode (u8), a length (u64) and that many bytes; a chunk contains further records. The summary after the data
repeats schemas and channels and counts the messages; it is used if it exists.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import IntEnum
from pathlib import Path
from struct import Struct, error
from types import MappingProxyType
from typing import Literal

from fieldsid.logs.readers.bags.containers.damage import Bytes, ChunkHead, Place, Records, forget, mapped
from fieldsid.logs.readers.bags.packets import LAST_NS, SETTLE_BYTES, Collector, Connection

MAGIC = b"\x89MCAP0\r\n"


class Op(IntEnum):
    """The opcodes of the records that are read."""

    FOOTER = 2
    SCHEMA = 3
    CHANNEL = 4
    MESSAGE = 5
    CHUNK = 6
    MESSAGE_INDEX = 7
    STATISTICS = 11
    DATA_END = 15


LEAST = dict(enumerate((8, 20, 14, 16, 22, 40, 6, 60, 36, 40, 46, 8, 20, 17, 4), start=1))
"""The shortest body of each record."""
OWN_OPS = 0x80
"""Records with this opcode or a higher one are private to an application and may have any content."""

_RECORD = Struct("<BQ")
_MESSAGE = Struct("<HIQQ")
_CHUNK = Struct("<QQQI")
_U16, _U32, _U64, _COUNT, _ENTRY = Struct("<H"), Struct("<I"), Struct("<Q"), Struct("<HQ"), Struct("<QQ")
LONGEST_NAME = 16
"""Largest number of letters in the name of a compression."""
_LIKE_A_RECORD = re.compile(rb"(?=[\x01-\x0f].{5}\x00{3})", re.DOTALL)
"""An opcode and a length below 2^40; a lookahead, so that matches may overlap."""
LANGUAGES: Mapping[str, Literal["msg", "idl"]] = MappingProxyType(
    {"ros2msg": "msg", "ros1msg": "msg", "ros2idl": "idl", "omgidl": "idl"}
)


def scan(path: Path, collector: Collector) -> None:
    """Read every record of a file into `collector`."""
    with mapped(path) as data:
        records = _Records(collector)
        records.summary(data)
        records.run(data, len(MAGIC), len(data), Place())
        if not records.done:
            collector.truncated("no footer", len(data))


class _Records(Records):
    """The records of an MCAP file, and of the chunks inside it."""

    def __init__(self, collector: Collector) -> None:
        super().__init__(collector)
        self.schemas: dict[int, tuple[str, str, str]] = {}
        self.done = False
        self.takers: dict[int, Callable[[bytes], None]] = {
            Op.SCHEMA: self._schema,
            Op.CHANNEL: self._channel,
            Op.STATISTICS: self._statistics,
        }

    def summary(self, data: Bytes) -> None:
        """Read schemas, channels and counts from the summary at the end of a complete file."""
        footer = len(data) - len(MAGIC) - 29
        if footer < len(MAGIC) or data[-len(MAGIC) :] != MAGIC or data[footer] != Op.FOOTER:
            return
        (pos,) = _U64.unpack_from(data, footer + 9)
        while len(MAGIC) <= pos < footer:
            op, length = _RECORD.unpack_from(data, pos)
            stop = pos + 9 + length
            if op not in LEAST or stop > footer:
                return
            if op in self.takers:
                self._is_parsed(op, bytes(data[pos + 9 : stop]))
            pos = stop

    def run(self, data: Bytes, pos: int, end: int, place: Place) -> None:
        """Read the records from `pos` to `end`, continuing after damaged places."""
        record, message, by_number, of_message = _RECORD.unpack_from, _MESSAGE.unpack_from, self.by_number, int(Op.MESSAGE)
        self.last = None
        settle_at = pos + SETTLE_BYTES if not place.chunk else end
        while pos < end and not self.done:
            op, length = record(data, pos) if pos + 9 <= end else (0, 0)
            stop = pos + 9 + length
            if op == of_message and length >= 22 and stop <= end:
                channel, _, stamp, _ = message(data, pos + 9)
                if channel in by_number and stamp <= LAST_NS:
                    if pos > settle_at:
                        settle_at = pos + SETTLE_BYTES
                        self.collector.has_read(SETTLE_BYTES)
                        forget(data, pos)
                    packets = self.last = by_number[channel]
                    if packets is not None:
                        packets.stamps.append(stamp)
                        packets.payloads.append(bytes(data[pos + 31 : stop]))
                    pos = stop
                    continue
            elif stop <= end and self._is_other(op, data, pos, stop, place):
                pos = stop
                continue
            pos = self.behind_damage(data, pos, end, place)

    def _is_other(self, op: int, data: Bytes, pos: int, stop: int, place: Place) -> bool:
        """Read a record that is no message; return whether such a record is allowed at this place.

        After a chunk, its last message remains the one that may be affected by damage that follows.
        """
        if stop - pos - 9 < LEAST.get(op, 0) or (op not in LEAST and op < OWN_OPS):
            return False
        if place.chunk and op not in (Op.SCHEMA, Op.CHANNEL):
            return False
        if op != Op.CHUNK:
            self.last = None
        if op in (Op.SCHEMA, Op.CHANNEL):
            return self._is_parsed(op, bytes(data[pos + 9 : stop]))
        if op == Op.CHUNK:
            return self._is_chunk(data, pos, stop, stop)
        self.done = op == Op.DATA_END
        return op != Op.MESSAGE

    def is_cut(self, data: Bytes, pos: int, end: int) -> bool:
        """Whether the record at `pos` is cut off by the end of the file; the rest of a chunk that is cut off is read."""
        if pos + 9 > end:
            return True
        op, length = _RECORD.unpack_from(data, pos)
        if op not in LEAST or pos + 9 + length <= end:
            return False
        return op != Op.CHUNK or self._is_chunk(data, pos, end, pos + 9 + length)

    def candidates(self, data: Bytes, pos: int, end: int) -> Iterator[int]:
        """Yield the offsets whose bytes may be the opcode and the length of a record."""
        return (match.start() for match in _LIKE_A_RECORD.finditer(data, pos, end))

    def end_behind_damage(self, data: Bytes, pos: int, end: int, place: Place) -> int | None:
        """Return the end of the record at `pos`, or None where the bytes are no valid record.

        The stamp of a message must lie in the range of its chunk, or outside of chunks near those read before.
        """
        if pos + 9 > end:
            return None
        op, length = _RECORD.unpack_from(data, pos)
        stop = int(pos + 9 + length)
        if stop > end or length < LEAST.get(op, length + 1):
            return None
        if op == Op.MESSAGE:
            channel, _, stamp, _ = _MESSAGE.unpack_from(data, pos + 9)
            low, high = (place.low, place.high) if place.chunk else self.near
            return stop if channel in self.by_number and low <= stamp <= high else None
        if place.chunk and op not in (Op.SCHEMA, Op.CHANNEL):
            return None
        return None if op == Op.CHUNK and _head_of_chunk(data, pos, stop) is None else stop

    def _is_chunk(self, data: Bytes, pos: int, stop: int, full_end: int) -> bool:
        """Read the records of a chunk that ends at `stop`; return whether the head of the chunk is valid.

        In a file that is not cut off the chunk would end at `full_end`.
        """
        head = _head_of_chunk(data, pos, full_end)
        if head is None:
            return False
        self.take_chunk(data, pos, stop, full_end, head)
        return True

    def stated_stamps(self, data: Bytes, pos: int) -> Iterator[tuple[int, Iterable[int]]]:
        """Yield each channel's number with its stamps in ns in the index records at `pos`."""
        while pos + 9 <= len(data) and data[pos] == Op.MESSAGE_INDEX:
            (_, length) = _RECORD.unpack_from(data, pos)
            stop = pos + 9 + length
            if length < LEAST[Op.MESSAGE_INDEX] or stop > len(data):
                return
            (channel,) = _U16.unpack_from(data, pos + 9)
            entries = _ENTRY.iter_unpack(data[pos + 15 : stop - (length - 6) % _ENTRY.size])
            yield channel, (stamp for stamp, _ in entries)
            pos = stop

    def _is_parsed(self, op: int, body: bytes) -> bool:
        """Read a schema, a channel or the statistics; return whether that was possible."""
        try:
            self.takers[op](body)
        except error:
            return False
        return True

    def _schema(self, body: bytes) -> None:
        number = int.from_bytes(body[:2], "little")
        name, pos = _text(body, 2)
        encoding, pos = _text(body, pos)
        self.schemas[number] = (name, encoding, _text(body, pos)[0])

    def _channel(self, body: bytes) -> None:
        number, schema = int.from_bytes(body[:2], "little"), int.from_bytes(body[2:4], "little")
        if number in self.by_number:
            return
        topic, pos = _text(body, 4)
        encoding, _ = _text(body, pos)
        name, language, definition = self.schemas.get(schema, ("", "", ""))
        parts = name.split("/")
        full = f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else name
        self.connect(number, Connection(topic, full, encoding, definition, LANGUAGES.get(language, "")))

    def _statistics(self, body: bytes) -> None:
        """Add the number of messages that the statistics state for each channel."""
        (size,) = _U32.unpack_from(body, 42)
        self.expect(body[46 : 46 + size], _COUNT)


def _head_of_chunk(data: Bytes, pos: int, stop: int) -> ChunkHead | None:
    """Return the head of the chunk at `pos` whose record ends at `stop`, or None where its lengths do not fit these bounds."""
    at = pos + 9 + _CHUNK.size
    if at + 4 > len(data):
        return None
    low, high, size, crc = _CHUNK.unpack_from(data, pos + 9)
    (letters,) = _U32.unpack_from(data, at)
    start = at + 4 + letters + 8
    if letters > LONGEST_NAME or start > min(stop, len(data)):
        return None
    compression = bytes(data[at + 4 : at + 4 + letters])
    (packed,) = _U64.unpack_from(data, start - 8)
    if start + packed != stop or not (compression.isalnum() or not compression):
        return None
    length = f"{max(high - low, 0) / 1e9:.2f} s"
    return ChunkHead(size if compression else packed, compression.decode("ascii"), start, length, low, high, crc)


def _text(body: bytes, pos: int) -> tuple[str, int]:
    """Return the text at `pos`, which its length precedes, and its end; raises struct.error where the body is too short."""
    (length,) = _U32.unpack_from(body, pos)
    end = pos + 4 + length
    if end > len(body):
        raise error(end)
    return body[pos + 4 : end].decode("utf-8", errors="replace"), end
