"""Records one behind the other, in a file and in its chunks, whatever the format: how they are read on behind damage.

They go on at the first place from which several records follow each other.
"""

from __future__ import annotations

import mmap
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fieldsid.logs.readers.bags.containers.decompress import unpacked
from fieldsid.logs.readers.bags.packets import LAST_NS, Collector, TopicPackets

Bytes = bytes | mmap.mmap
CHAIN = 3
"""Records that must follow each other: three by chance, each with its op, length and known connection, are none."""


def resumed(candidates: Iterable[int], sound: Callable[[int], int | None], end: int) -> int | None:
    """Return the first candidate from which records follow each other; `sound` gives the end of a record, or None."""
    return next((place for place in candidates if _follow(place, sound, end)), None)


def _follow(place: int, sound: Callable[[int], int | None], end: int) -> bool:
    for _ in range(CHAIN):
        stop = sound(place)
        if stop is None:
            return False
        if stop == end:
            return True
        place = stop
    return True


@contextmanager
def mapped(path: Path) -> Iterator[mmap.mmap]:
    """Yield a file's bytes, read as they are asked for."""
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        yield data


def forget(data: Bytes, place: int) -> None:
    """Give back the memory of a mapped file up to a place; the bytes are read again should anybody ask for them."""
    if isinstance(data, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        data.madvise(mmap.MADV_DONTNEED, 0, place // mmap.PAGESIZE * mmap.PAGESIZE)


@dataclass(frozen=True, slots=True)
class Place:
    """Where the bytes stand that are being read: in the chunk at byte `chunk`, of stamps from `low` to `high`, or in none (0)."""

    chunk: int = 0
    is_packed: bool = False
    is_cut: bool = False
    low: int = 0
    high: int = LAST_NS


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """What the head of a chunk states: bytes when unpacked, where its records start, its length in words, stamps and checksum."""

    size: int
    compression: str
    start: int
    length: str
    low: int = 0
    high: int = LAST_NS
    crc: int = 0

    def is_wrong(self, plain: bytes) -> bool:
        """Whether bytes do not have the checksum that is stated; 0 states none."""
        return self.crc != 0 and zlib.crc32(plain) != self.crc


class Records(ABC):
    """The records of a file, and of the chunks inside it: topics and their packets by the number that the file gives each."""

    cut_where = ""
    """What a file that ends inside a record is said to be cut in, where nothing else of the format says that it is cut."""

    def __init__(self, collector: Collector) -> None:
        self.collector = collector
        self.topics: dict[int, str] = {}
        self.by_number: dict[int, TopicPackets | None] = {}
        self.last: TopicPackets | None = None
        self.near = (0, LAST_NS)

    @abstractmethod
    def run(self, data: Bytes, pos: int, end: int, place: Place) -> None:
        """Read the records from `pos` to `end`, and on behind damage."""

    @abstractmethod
    def candidates(self, data: Bytes, pos: int, end: int) -> Iterator[int]:
        """Yield the places from which a record may start."""

    @abstractmethod
    def end_behind_damage(self, data: Bytes, pos: int, end: int, place: Place) -> int | None:
        """Return the end of the record at `pos`, or None where none can be; a message has a stamp near the last one."""

    @abstractmethod
    def is_cut(self, data: Bytes, pos: int, end: int) -> bool:
        """Whether the last record is cut by the end of the file; what is left of a chunk is taken."""

    @abstractmethod
    def stated_stamps(self, data: Bytes, pos: int) -> Iterator[tuple[int, Iterable[int]]]:
        """Yield the stamps in ns that the index records at `pos`, behind a chunk, state of its messages, by number."""

    def behind_damage(self, data: Bytes, pos: int, end: int, place: Place) -> int:
        """Return where records go on; leave out the message before damage, which may begin inside that one."""
        self.near = self.collector.stamps_near(self.last)
        go_on = resumed(self.candidates(data, pos + 1, end), lambda at: self.end_behind_damage(data, at, end, place), end)
        if go_on is None and (not place.chunk or place.is_cut) and self.is_cut(data, pos, end):
            if self.cut_where and not place.chunk:
                self.collector.truncated(self.cut_where, end)
            return end
        self.leave_out_last()
        stop = end if go_on is None else go_on
        if place.is_packed:
            self.collector.damaged_at(f"{stop - pos} bytes of the compressed chunk", place.chunk)
        else:
            self.collector.damaged_at(f"{stop - pos} bytes", pos)
        return stop

    def leave_out_last(self) -> None:
        """Forget the message that came last, where it waits."""
        if self.last is not None:
            self.last.leave_out_last()
            self.last = None

    def take_chunk(self, data: Bytes, pos: int, stop: int, whole: int, head: ChunkHead) -> None:
        """Read the records of the chunk at `pos` that ends at `stop`, in a file that is not cut at `whole`."""
        self.collector.has_read(stop - pos)
        forget(data, pos)
        place = Place(pos, bool(head.compression), stop < whole, head.low, head.high)
        got = (self._packed_chunk if place.is_packed else self._plain_chunk)(data, stop, head, place)
        if place.is_cut:
            self.collector.cut_chunk(pos, got, head.size)

    def _packed_chunk(self, data: Bytes, stop: int, head: ChunkHead, place: Place) -> int:
        """Read what a compressed chunk holds as far as it is whole, or leave it out; return its bytes.

        Where no checksum is stated, the stamps of its messages must be those that the index behind it states.
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
        """Read a chunk that is not compressed; one whose checksum fails though its records look sound is left out."""
        counts, damages = self.collector.counts(), self.collector.damages
        self.run(data, head.start, stop, place)
        if place.is_cut or damages < self.collector.damages or not head.is_wrong(data[head.start : stop]):
            return stop - head.start
        if self.end_behind_damage(data, stop, len(data), Place()) is None:
            self.leave_out_last()  # the damage is that behind the chunk, and begins inside its last message
        else:
            self.collector.leave_out_from(counts)
            self.collector.damaged_at(f"a chunk of {head.length} whose checksum does not hold", place.chunk)
        return stop - head.start

    def _agrees_with_index(self, data: Bytes, pos: int, counts: Mapping[str, int]) -> bool:
        """Whether the messages of a chunk have the stamps that the index records behind it state; true without any.

        Damaged data may unpack without an error. The stamps are the numbers that differ in every record, so that damage
        shows in them.
        """
        stated: dict[str, list[int]] = {}
        for number, stamps in self.stated_stamps(data, pos):
            stated.setdefault(self.topics.get(number, ""), []).extend(stamps)
        found = self.collector.stamps_since(counts)
        return all(sorted(found[topic]) == sorted(stamps) for topic, stamps in stated.items() if topic in found)
