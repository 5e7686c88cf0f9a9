"""Collect the connections of a bag, and their packets with receive stamps, before the messages are decoded."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fieldsid.logs.convert.times.clock_text import DAY_S
from fieldsid.logs.readers._unpacked import UnpackedSize
from fieldsid.logs.run import Note

ROS1, CDR = "ros1", "cdr"
"""Serializations that can be decoded."""

LAST_NS = int(np.iinfo(np.int64).max)
"""Largest stamp that is a signed 64-bit number; a larger stamp is damaged."""

MOST_PLACES_NOTED = 5
"""Number of damaged places with a note each; the others are only counted."""

DAY_NS = int(DAY_S * 1e9)

SETTLE_BYTES = 1 << 23
"""Bytes of a file after which the waiting payloads are settled: enough for decoding in blocks, little compared with 500 MiB."""


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
        """Whether the messages are in a known serialization."""
        return self.serialization in (ROS1, CDR)


@dataclass(frozen=True, slots=True)
class TopicPackets:
    """The packets of one topic: all receive stamps in ns, and the payloads that still wait to be settled."""

    topic: str
    stamps: array[int] = field(default_factory=lambda: array("q"))
    payloads: list[bytes] = field(default_factory=list)

    def leave_out_last(self) -> None:
        """Remove the last packet, if its payload still waits."""
        self.leave_out_from(len(self.stamps) - 1)

    def leave_out_from(self, count: int) -> None:
        """Remove the packets after the first `count` whose payloads still wait."""
        surplus = min(len(self.stamps) - count, len(self.payloads))
        if surplus > 0:
            del self.stamps[-surplus:], self.payloads[-surplus:]


Settle = Callable[[Connection, TopicPackets], None]
"""Function that settles the waiting payloads: it decodes and clears them, or keeps them."""


def keep_all(connection: Connection, packets: TopicPackets) -> None:
    """Keep all payloads until the bag is read to its end."""


def keep_first(connection: Connection, packets: TopicPackets) -> None:
    """Keep the first payload, from which the fields of the topic are found."""
    del packets.payloads[1:]


class Collector:
    """Collect the connections of a bag by topic, and the packets of the topics that are wanted (all when None).

    expected: the number of messages by topic that the index of the bag states. file: the name of the file that is being read.
    size: the bytes of all files; `progress` is called with the share of them that was read. unpacked: counts the unpacked bytes.
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
        """Register a connection; return the collection for its packets, or None when its topic is not wanted."""
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
        """Return the plausible range of stamps after damage: within a day of the latest one, without the last stamp of `last`."""
        stamps = [p.stamps[-2 if p is last else -1] for p in self.packets.values() if len(p.stamps) > (p is last)]
        return (max(stamps) - DAY_NS, max(stamps) + DAY_NS) if stamps else (0, LAST_NS)

    def leave_out_from(self, counts: Mapping[str, int]) -> None:
        """Remove the packets that came after `counts`; they must not have been settled."""
        for topic, packets in self.packets.items():
            packets.leave_out_from(counts.get(topic, 0))

    def has_read(self, size: int) -> None:
        """Count bytes that were read; settle the waiting payloads every SETTLE_BYTES."""
        self._waiting += size
        if self._waiting >= SETTLE_BYTES:
            self.settle()

    def settle(self) -> None:
        """Pass on the waiting payloads, and report the progress."""
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
        """Note a chunk whose end is missing; of compressed data only complete blocks can be read."""
        message = f"the chunk at byte {position} of {self.file} is cut: {got} of its {size} bytes could be read"
        self.notes.append(Note("truncated", message, {"byte": position, "read": got, "of": size}))

    def damaged_at(self, what: str, position: int) -> None:
        """Note bytes of a file that could not be read."""
        self.damaged(f"{what} at byte {position} of {self.file}", {"file": self.file, "byte": position})

    def damaged(self, what: str, data: Mapping[str, Any]) -> None:
        """Note a part of a bag that could not be read; of many places only the first ones get a note each."""
        self.damages += 1
        if self.damages <= MOST_PLACES_NOTED:
            self.notes.append(Note("damaged", f"{what}: damaged, left out with what may be damaged beside it", data))

    def expect(self, topic: str, count: int) -> None:
        """Add to the number of messages of a topic that the files state."""
        self.expected[topic] = self.expected.get(topic, 0) + count

    def note_further_places(self) -> None:
        """Note the number of damaged places without a separate note."""
        if self.damages > MOST_PLACES_NOTED:
            more = self.damages - MOST_PLACES_NOTED
            self.notes.append(Note("damaged", f"{more} more places are damaged and were left out", {"places": more}))
