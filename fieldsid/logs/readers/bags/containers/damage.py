"""Read the sequence of records of a file and of its chunks, in any format, and continue after damaged places.

Reading continues at the first offset from which several valid records follow each other.
"""

from __future__ import annotations

import mmap
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from struct import Struct

from fieldsid.logs.readers.bags.containers.decompress import unpacked
from fieldsid.logs.readers.bags.packets import LAST_NS, Collector, Connection, TopicPackets

Bytes = bytes | mmap.mmap
CHAIN = 3
"""Number of records that must follow each other; three are never found by chance, with op, length and known connection."""


def resumed(candidates: Iterable[int], end_of_record: Callable[[int], int | None], end: int) -> int | None:
    """Return the first candidate offset from which valid records follow each other, or None.

    `end_of_record` returns the end of a valid record, else None.
    """
    return next((place for place in candidates if _follow(place, end_of_record, end)), None)


def _follow(place: int, end_of_record: Callable[[int], int | None], end: int) -> bool:
    """Whether CHAIN valid records follow each other from an offset, or fewer up to the end."""
    for _ in range(CHAIN):
        stop = end_of_record(place)
        if stop is None:
            return False
        if stop == end:
            return True
        place = stop
    return True


@contextmanager
def mapped(path: Path) -> Iterator[mmap.mmap]:
    """Yield the bytes of a file, mapped to memory."""
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        yield data


def forget(data: Bytes, place: int) -> None:
    """Release the memory of a mapped file up to an offset; the bytes are read again if they are used later."""
    if isinstance(data, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        data.madvise(mmap.MADV_DONTNEED, 0, place // mmap.PAGESIZE * mmap.PAGESIZE)


@dataclass(frozen=True, slots=True)
class Place:
    """The chunk that is being read: the one at offset `chunk`, with stamps in ns from `low` to `high`; none where that is 0."""

    chunk: int = 0
    is_packed: bool = False
    is_cut: bool = False
    low: int = 0
    high: int = LAST_NS


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """The head of a chunk: number of unpacked bytes, compression, offset of its records, length in words, stamps and checksum."""

    size: int
    compression: str
    start: int
    length: str
    low: int = 0
    high: int = LAST_NS
    crc: int = 0

    def is_wrong(self, plain: bytes) -> bool:
        """Whether bytes differ from the stated checksum; 0 means that none is stated."""
        return self.crc != 0 and zlib.crc32(plain) != self.crc


class Records(ABC):
    """The records of a file, and of the chunks inside it: topics and their packets by their number in the file."""

    cut_where = ""
    """Words for the place at which a file is cut off, for a format that does not mark its end; else empty."""

    def __init__(self, collector: Collector) -> None:
        self.collector = collector
        self.topics: dict[int, str] = {}
        self.by_number: dict[int, TopicPackets | None] = {}
        self.last: TopicPackets | None = None
        self.near = (0, LAST_NS)

    @abstractmethod
    def run(self, data: Bytes, pos: int, end: int, place: Place) -> None:
        """Read the records from `pos` to `end`, continuing after damaged places."""

    @abstractmethod
    def candidates(self, data: Bytes, pos: int, end: int) -> Iterator[int]:
        """Yield the offsets at which a record may start."""

    @abstractmethod
    def end_behind_damage(self, data: Bytes, pos: int, end: int, place: Place) -> int | None:
        """Return the end of the record at `pos`, or None where the bytes are no valid record with a plausible stamp."""

    @abstractmethod
    def is_cut(self, data: Bytes, pos: int, end: int) -> bool:
        """Whether the record at `pos` is cut off by the end of the file; the rest of a chunk that is cut off is read."""

    @abstractmethod
    def stated_stamps(self, data: Bytes, pos: int) -> Iterator[tuple[int, Iterable[int]]]:
        """Yield each connection's number with the stamps in ns that the index records at `pos`, after a chunk, state."""

    def behind_damage(self, data: Bytes, pos: int, end: int, place: Place) -> int:
        """Return the offset at which valid records continue; leave out the last message, in which the damage may begin."""
        self.near = self.collector.stamps_near(self.last)
        resume = resumed(self.candidates(data, pos + 1, end), lambda at: self.end_behind_damage(data, at, end, place), end)
        if resume is None and (not place.chunk or place.is_cut) and self.is_cut(data, pos, end):
            if self.cut_where and not place.chunk:
                self.collector.truncated(self.cut_where, end)
            return end
        self.leave_out_last()
        stop = end if resume is None else resume
        if place.is_packed:
            self.collector.damaged_at(f"{stop - pos} bytes of the compressed chunk", place.chunk)
        else:
            self.collector.damaged_at(f"{stop - pos} bytes", pos)
        return stop

    def connect(self, number: int, connection: Connection) -> None:
        """Register the connection of a number of the file."""
        self.topics[number] = connection.topic
        self.by_number[number] = self.collector.connect(connection)

    def expect(self, counts: bytes, entry: Struct) -> None:
        """Add the numbers of messages that an index states, in entries of a connection's number and its count."""
        for number, count in entry.iter_unpack(counts[: len(counts) - len(counts) % entry.size]):
            if number in self.topics:
                self.collector.expect(self.topics[number], count)

    def leave_out_last(self) -> None:
        """Remove the last message, if it still waits."""
        if self.last is not None:
            self.last.leave_out_last()
            self.last = None

    def take_chunk(self, data: Bytes, pos: int, stop: int, full_end: int, head: ChunkHead) -> None:
        """Read the records of the chunk at `pos` that ends at `stop`; in a file not cut off it would end at `full_end`."""
        self.collector.has_read(stop - pos)
        forget(data, pos)
        place = Place(pos, bool(head.compression), stop < full_end, head.low, head.high)
        got = (self._packed_chunk if place.is_packed else self._plain_chunk)(data, stop, head, place)
        if place.is_cut:
            self.collector.cut_chunk(pos, got, head.size)

    def _packed_chunk(self, data: Bytes, stop: int, head: ChunkHead, place: Place) -> int:
        """Read a compressed chunk as far as it is complete, or leave it out; return the number of bytes read.

        Where no checksum is stated, the stamps of its messages must agree with the index after the chunk.
        """
        plain = unpacked(bytes(data[head.start : stop]), head.compression, head.size)
        if plain is None or not (place.is_cut or (len(plain) == head.size and not head.is_wrong(plain))):
            self.collector.damaged_at(f"a compressed chunk of {head.length}", place.chunk)
            return 0
        self.collector.unpacked.add(len(plain))
        counts = self.collector.counts()
        self.run(plain, 0, len(plain), place)
        if not (head.crc or place.is_cut or self._agrees_with_index(data, stop, counts)):
            self.collector.leave_out_from(counts)
            self.collector.damaged_at(f"a compressed chunk of {head.length}", place.chunk)
        return len(plain)

    def _plain_chunk(self, data: Bytes, stop: int, head: ChunkHead, place: Place) -> int:
        """Read an uncompressed chunk, and leave it out if its checksum is wrong although its records are valid.

        Returns the number of its bytes.
        """
        counts, damages = self.collector.counts(), self.collector.damages
        self.run(data, head.start, stop, place)
        if place.is_cut or damages < self.collector.damages or not head.is_wrong(data[head.start : stop]):
            return stop - head.start
        if self.end_behind_damage(data, stop, len(data), Place()) is None:
            self.leave_out_last()  # the damage follows the chunk, and begins inside its last message
        else:
            self.collector.leave_out_from(counts)
            self.collector.damaged_at(f"a chunk of {head.length} whose checksum does not hold", place.chunk)
        return stop - head.start

    def _agrees_with_index(self, data: Bytes, pos: int, counts: Mapping[str, int]) -> bool:
        """Whether the messages of a chunk have the stamps that the index records after it state; true without index records.

        Damaged data may unpack without an error. The stamps differ from record to record, so that the damage changes them.
        """
        stated: dict[str, list[int]] = {}
        for number, stamps in self.stated_stamps(data, pos):
            stated.setdefault(self.topics.get(number, ""), []).extend(stamps)
        found = self.collector.stamps_since(counts)
        return all(sorted(found[topic]) == sorted(stamps) for topic, stamps in stated.items() if topic in found)
