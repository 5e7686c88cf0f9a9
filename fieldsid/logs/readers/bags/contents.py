"""What is in a bag: topics with their type, count and rate, and the first value, least and largest of every number inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.reader import MOST_CHANNELS, ChannelInfo, FieldInfo, Inventory, ReadOptions, span_of
from fieldsid.logs.readers.bags.messages.definitions import DefinitionSearch, decoder_of
from fieldsid.logs.readers.bags.messages.message_layout import Decoder
from fieldsid.logs.readers.bags.packets import CDR, ROS1, Collector, Connection, TopicPackets, keep_first
from fieldsid.logs.readers.bags.signals import check_not_empty, undecodable
from fieldsid.logs.run import Note

MOST_NUMBERS = 200
"""Numbers in a message beyond which it is a picture or a cloud of points: of those only the first values are told."""
MOST_AT_ONCE = 500
"""Messages of each piece of a bag that tell the ranges."""
Span = tuple[float, float]


@dataclass(slots=True)
class _Topic:
    """The numbers of one topic: first values by path, and the ranges seen so far; or the error that says why there are none."""

    decoder: Decoder | None = None
    first: dict[str, Any] = field(default_factory=dict)
    spans: dict[str, Span] = field(default_factory=dict)
    note: Note | None = None
    error: LogError | None = None

    def see(self, payloads: Sequence[bytes]) -> None:
        """Widen the ranges by some messages."""
        if self.decoder is None or not 0 < len(self.first) <= MOST_NUMBERS:
            return
        paths = list(self.first)
        columns, good = self.decoder.decode(payloads[:: max(1, len(payloads) // MOST_AT_ONCE)], paths)
        for path, column in zip(paths, columns, strict=True):
            found = span_of(np.asarray(column[good], dtype=np.float64)[:, 0]) if column.shape[1] == 1 else None
            if found is not None:
                known = self.spans.get(path, found)
                self.spans[path] = (min(known[0], found[0]), max(known[1], found[1]))


class Contents:
    """The inventory of a bag as it is read, piece by piece."""

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self.path = path
        self.search = DefinitionSearch(path, options.msg_path)
        self.topics: dict[str, _Topic] = {}

    def settle(self, connection: Connection, packets: TopicPackets) -> None:
        """See the messages that came, and keep the first."""
        known = self.topics.get(connection.topic)
        if known is None and len(self.topics) >= MOST_CHANNELS:
            keep_first(connection, packets)
            return
        if known is None:
            known = self.topics[connection.topic] = self._begun(connection, packets.payloads[0])
            known.see(packets.payloads)
        else:
            known.see(packets.payloads[1:])
        keep_first(connection, packets)

    def _begun(self, connection: Connection, payload: bytes) -> _Topic:
        try:
            if not connection.is_decodable:
                raise undecodable(connection)
            decoder, note = decoder_of(connection, payload, self.search)
            return _Topic(decoder, decoder.first_values(payload), note=note)
        except LogError as error:
            data = {"topic": connection.topic, "found": error.found, "hint": error.hint}
            message = f"{connection.topic}: {error.what}; {error.hint}"
            note = Note("definition" if connection.is_decodable else "serialization", message, data)
            return _Topic(note=note, error=error)

    def inventory(self, collector: Collector) -> Inventory:
        """Return the inventory of a bag whose topics were all caught; raises LogError for a bag of which nothing can be read."""
        check_not_empty(self.path, collector)
        self._refuse_unreadable()
        names = sorted(t for t in collector.connections if t in self.topics)
        channels = [self._channel(collector.connections[t], collector.packets[t]) for t in names]
        notes = [*collector.notes, *(found.note for _, found in sorted(self.topics.items()) if found.note is not None)]
        ends = [s for packets in collector.packets.values() if packets.stamps for s in (min(packets.stamps), max(packets.stamps))]
        duration = (max(ends) - min(ends)) / 1e9 if ends else 0.0
        serialization = next((c.serialization for c in collector.connections.values()), "")
        form = {ROS1: "ROS 1 bag", CDR: "ROS 2 bag"}.get(serialization, "bag")
        return Inventory(self.path, form, duration, tuple(channels), notes=tuple(notes))

    def _refuse_unreadable(self) -> None:
        """Raise the error of the first topic where no topic can be read: such a bag is no log yet."""
        errors = [found.error for _, found in sorted(self.topics.items()) if found.error is not None]
        if errors and len(errors) == len(self.topics):
            raise errors[0]

    def _channel(self, connection: Connection, packets: TopicPackets) -> ChannelInfo:
        known = self.topics.get(connection.topic, _Topic())
        fields = tuple(FieldInfo(p, type(v).__name__, (v,), known.spans.get(p)) for p, v in known.first.items())
        steps = np.diff(np.sort(np.frombuffer(packets.stamps, dtype=np.int64)))
        period = float(np.median(steps)) / 1e9 if steps.size else 0.0
        rate = 1.0 / period if period > 0.0 else float("nan")
        return ChannelInfo(connection.topic, connection.type_name, len(packets.stamps), rate, fields)
