"""What a bag holds before its messages are decoded: connections, and their packets with the receive stamps."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Literal

from fieldsid.logs.run import Note

ENOUGH = 1 << 62


@dataclass(frozen=True, slots=True)
class Link:
    """One connection: topic, message type (`pkg/msg/Name`), its definition and how messages are encoded."""

    topic: str
    type_name: str
    encoding: Literal["ros1", "cdr", "other"]
    definition: str = ""
    language: Literal["msg", "idl", ""] = ""


@dataclass(slots=True)
class Slot:
    """The packets of one topic: receive stamps in ns, and the first `keep` payloads."""

    keep: int = ENOUGH
    stamps: list[int] = field(default_factory=list)
    payloads: list[bytes] = field(default_factory=list)

    def take(self, stamp: int, payload: bytes) -> None:
        """Add a packet."""
        self.stamps.append(stamp)
        if len(self.payloads) < self.keep:
            self.payloads.append(payload)


class Catch:
    """What a scan brings in: links by topic, and slots for the topics that are wanted (all when None)."""

    def __init__(self, wanted: Collection[str] | None = None, keep: int = ENOUGH) -> None:
        self.wanted = wanted
        self.keep = keep
        self.links: dict[str, Link] = {}
        self.slots: dict[str, Slot] = {}
        self.notes: list[Note] = []
        self.mixed: set[str] = set()

    def link(self, link: Link) -> Slot | None:
        """Register a connection; return the slot its packets go to, or None when nobody wants them."""
        known = self.links.get(link.topic)
        if known is None or (not known.definition and link.definition):
            self.links[link.topic] = link
        if known is not None and known.type_name != link.type_name:
            self.mixed.add(link.topic)
        if self.wanted is not None and link.topic not in self.wanted:
            return None
        return self.slots.setdefault(link.topic, Slot(self.keep))

    def truncated(self, where: str, size: int) -> None:
        """Note that a file ends early."""
        message = f"the bag is cut off at byte {size}: {where}; what stands before it was read"
        self.notes.append(Note("truncated", message, {"bytes": size}))

    def damaged(self, what: str, position: int) -> None:
        """Note a part of a file that could not be read."""
        self.notes.append(Note("damaged", f"{what} at byte {position} is damaged and was left out", {"byte": position}))
