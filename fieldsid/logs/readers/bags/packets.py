"""What a bag holds before its messages are decoded: connections, and their packets with the receive stamps."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from fieldsid.logs.readers._unpacked import UnpackedSize
from fieldsid.logs.run import Note

ROS1, CDR = "ros1", "cdr"
"""Serializations whose messages can be decoded."""

LAST_NS = (1 << 63) - 1
"""Largest stamp that is a signed 64-bit number; only damage makes a larger one."""

TOLD_PLACES = 5
"""Damaged places that are noted one by one; of more, only the number is."""

DAY_NS = 86_400 * 1_000_000_000

SETTLE_BYTES = 1 << 23
"""Bytes of a file that are read before what waits is settled: enough to decode in blocks, little beside 500 MiB."""


@dataclass(frozen=True, slots=True)
class Connection:
    """One connection: topic, message type (`pkg/msg/Name`), how its messages are serialized, and their definition."""

    topic: str
    type_name: str
    serialization: str
    definition: str = ""
    language: Literal["msg", "idl", ""] = ""

    @property
    def is_decodable(self) -> bool:
        """Whether messages are in a serialization that is known."""
        return self.serialization in (ROS1, CDR)


@dataclass(frozen=True, slots=True)
class TopicPackets:
    """The packets of one topic: all receive stamps in ns, and the payloads that have not been settled yet."""

    topic: str
    stamps: array[int] = field(default_factory=lambda: array("q"))
    payloads: list[bytes] = field(default_factory=list)

    def leave_out_last(self) -> None:
        """Forget the packet that came last, where it waits."""
        self.leave_out_from(len(self.stamps) - 1)

    def leave_out_from(self, count: int) -> None:
        """Forget the packets that wait and came after the first `count`."""
        surplus = min(len(self.stamps) - count, len(self.payloads))
        if surplus > 0:
            del self.stamps[-surplus:], self.payloads[-surplus:]


Settle = Callable[[Connection, TopicPackets], None]
"""What is done with the payloads that wait: decode and clear them, or keep them all."""


def keep_all(connection: Connection, packets: TopicPackets) -> None:
    """Let the payloads wait to the end."""


def keep_first(connection: Connection, packets: TopicPackets) -> None:
    """Keep one payload, to see what is inside."""
    del packets.payloads[1:]


class Collector:
    """What the reading of a bag brings in: connections by topic, and packets of the topics that are wanted (all when None).

    `expected` is the number of messages that the bag's own index states, by topic; `file` the one that is being read; `size`
    the bytes of all, of which `progress` is given the share; `unpacked` counts what they unpack to.
    """

    def __init__(
        self,
        wanted: Collection[str] | None = None,
        settle: Settle = keep_all,
        progress: Callable[[float], None] = lambda _: None,
    ) -> None:
        self.wanted = wanted
        self.connections: dict[str, Connection] = {}
        self.packets: dict[str, TopicPackets] = {}
        self.expected: dict[str, int] = {}
        self.notes: list[Note] = []
        self.mixed: set[str] = set()
        self.damages = 0
        self.file = ""
        self.size = 1
        self.unpacked = UnpackedSize(Path(), 0)
        self._settle = settle
        self._progress = progress
        self._waiting = self._read = 0

    def connect(self, connection: Connection) -> TopicPackets | None:
        """Register a connection; return where its packets go, or None when nobody wants them."""
        topic = connection.topic
        known = self.connections.get(topic)
        if known is None or (not known.definition and connection.definition):
            self.connections[topic] = connection
        if known is not None and known.type_name != connection.type_name:
            self.mixed.add(topic)
        if self.wanted is not None and topic not in self.wanted:
            return None
        return self.packets.setdefault(topic, TopicPackets(topic))

    def counts(self) -> dict[str, int]:
        """Return the number of packets by topic so far."""
        return {topic: len(p.stamps) for topic, p in self.packets.items()}

    def stamps_since(self, counts: Mapping[str, int]) -> dict[str, list[int]]:
        """Return the stamps by topic of the packets that came after `counts`."""
        return {topic: p.stamps[counts.get(topic, 0) :].tolist() for topic, p in self.packets.items()}

    def stamps_near(self, last: TopicPackets | None) -> tuple[int, int]:
        """Return what stamps behind damage may be: within a day of the latest one, that of `last` not counted."""
        stamps = [p.stamps[-2 if p is last else -1] for p in self.packets.values() if len(p.stamps) > (p is last)]
        return (max(stamps) - DAY_NS, max(stamps) + DAY_NS) if stamps else (0, LAST_NS)

    def leave_out_from(self, counts: Mapping[str, int]) -> None:
        """Forget the packets that came after `counts`; they must not have been settled."""
        for topic, packets in self.packets.items():
            packets.leave_out_from(counts.get(topic, 0))

    def has_read(self, size: int) -> None:
        """Count bytes that were read; what waits is settled every SETTLE_BYTES."""
        self._waiting += size
        if self._waiting >= SETTLE_BYTES:
            self.settle()

    def settle(self) -> None:
        """Hand on what waits, and tell how far the reading is."""
        self._read += self._waiting
        self._waiting = 0
        self._progress(min(self._read / self.size, 1.0))
        for topic, packets in self.packets.items():
            if packets.payloads:
                self._settle(self.connections[topic], packets)

    def truncated(self, where: str, size: int) -> None:
        """Note that a file ends early."""
        message = f"{self.file} is cut off at byte {size}: {where}; what stands before it was read"
        self.notes.append(Note("truncated", message, {"bytes": size}))

    def cut_chunk(self, position: int, got: int, size: int) -> None:
        """Note a chunk whose end is missing; compressed data give whole blocks only."""
        message = f"the chunk at byte {position} of {self.file} is cut: {got} of its {size} bytes could be read"
        self.notes.append(Note("truncated", message, {"byte": position, "read": got, "of": size}))

    def damaged_at(self, what: str, position: int) -> None:
        """Note bytes of a file that could not be read."""
        self.damaged(f"{what} at byte {position} of {self.file}", {"file": self.file, "byte": position})

    def damaged(self, what: str, data: Mapping[str, Any]) -> None:
        """Note a part of a bag that could not be read; the first of many places get a note each."""
        self.damages += 1
        if self.damages <= TOLD_PLACES:
            self.notes.append(Note("damaged", f"{what}: damaged, left out with what may be damaged beside it", data))

    def expect(self, topic: str, count: int) -> None:
        """Add to the number of messages that the files themselves state."""
        self.expected[topic] = self.expected.get(topic, 0) + count

    def say_untold_places(self) -> None:
        """Note how many places are damaged besides those that have a note."""
        if self.damages > TOLD_PLACES:
            more = self.damages - TOLD_PLACES
            self.notes.append(Note("damaged", f"{more} more places are damaged and were left out", {"places": more}))
