"""Return the inventory of a bag (topics with count, rate and ranges) and its mapped signals, by header or receive stamps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.channels import ChannelMap, Source, Stamp
from fieldsid.logs.reader import MOST_CHANNELS, ChannelInfo, FieldInfo, Inventory, RawLog, ReadOptions, rate_of, span_of
from fieldsid.logs.readers._topics import topic_name
from fieldsid.logs.readers.bags.messages.definitions import DefinitionSearch, decoder_of
from fieldsid.logs.readers.bags.messages.message_layout import Decoder
from fieldsid.logs.readers.bags.messages.topic import TopicDecoding, TopicSeries
from fieldsid.logs.readers.bags.packets import CDR, ROS1, Collector, Connection, TopicPackets, keep_first
from fieldsid.logs.readers.bags.stores import collected
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import COPY_AGAIN

MOST_NUMBERS = 200
"""Numbers in a message above which it is an image or a point cloud, of which only the first values are shown."""
MOST_AT_ONCE = 500
"""Messages of each piece of a bag that are decoded for the ranges."""
Span = tuple[float, float]


@dataclass(slots=True)
class _Topic:
    """The numbers of one topic: first values and ranges so far by path; or the error because of which there are none."""

    decoder: Decoder | None = None
    first: dict[str, Any] = field(default_factory=dict)
    spans: dict[str, Span] = field(default_factory=dict)
    note: Note | None = None
    error: LogError | None = None

    def see(self, payloads: Sequence[bytes]) -> None:
        """Extend the ranges by the values in some messages."""
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
    """The inventory of a bag, built piece by piece while it is read."""

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self.path = path
        self.search = DefinitionSearch(path, options.msg_path)
        self.topics: dict[str, _Topic] = {}

    def settle(self, connection: Connection, packets: TopicPackets) -> None:
        """Extend the ranges by the waiting messages, and keep only the first message."""
        known = self.topics.get(connection.topic)
        if known is None and len(self.topics) >= MOST_CHANNELS:
            keep_first(connection, packets)
            return
        if known is None:
            known = self.topics[connection.topic] = self._new_topic(connection, packets.payloads[0])
            known.see(packets.payloads)
        else:
            known.see(packets.payloads[1:])
        keep_first(connection, packets)

    def _new_topic(self, connection: Connection, payload: bytes) -> _Topic:
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
        """Return the inventory of a bag that was read; raises LogError for a bag of which nothing can be decoded."""
        check_not_empty(self.path, collector)
        errors = [found.error for _, found in sorted(self.topics.items()) if found.error is not None]
        if errors and len(errors) == len(self.topics):  # without a topic that can be decoded the bag is no usable log
            raise errors[0]
        names = sorted(t for t in collector.connections if t in self.topics)
        channels = [self._channel(collector.connections[t], collector.packets[t]) for t in names]
        notes = [*collector.notes, *(found.note for _, found in sorted(self.topics.items()) if found.note is not None)]
        ends = [s for packets in collector.packets.values() if packets.stamps for s in (min(packets.stamps), max(packets.stamps))]
        duration = (max(ends) - min(ends)) / 1e9 if ends else 0.0
        serialization = next((c.serialization for c in collector.connections.values()), "")
        form = {ROS1: "ROS 1 bag", CDR: "ROS 2 bag"}.get(serialization, "bag")
        return Inventory(self.path, form, duration, tuple(channels), notes=tuple(notes))

    def _channel(self, connection: Connection, packets: TopicPackets) -> ChannelInfo:
        known = self.topics.get(connection.topic, _Topic())
        fields = tuple(FieldInfo(p, type(v).__name__, (v,), known.spans.get(p)) for p, v in known.first.items())
        rate = 1e9 * rate_of(np.sort(np.frombuffer(packets.stamps, dtype=np.int64)))
        return ChannelInfo(connection.topic, connection.type_name, len(packets.stamps), rate, fields)


LATE_S = 1.0
"""Largest difference of header and receive stamps that is a delay; a larger one means two different clocks."""


def read_signals(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the series that a mapping names; raises MappingError for an unknown topic or field, LogError for an empty bag."""
    decoding: dict[str, TopicDecoding] = {}
    for topic in dict.fromkeys(s.topic for s in mapping.sources.values() if s.topic is not None):
        sources = {signal: s for signal, s in mapping.sources.items() if s.topic == topic}
        decoding[topic] = TopicDecoding(sources, DefinitionSearch(path, options.msg_path))
    collector = collected(path, decoding.keys(), lambda c, packets: decoding[c.topic].settle(c, packets), options.progress)
    if not decoding and mapping.sources:
        _topic(path, collector, *next(iter(mapping.sources.items())))
    check_not_empty(path, collector)
    for signal, source in mapping.sources.items():
        _topic(path, collector, signal, source)
    topics = [d.joined(collector.connections[t], collector.packets[t]) for t, d in decoding.items()]
    return _raw_log(path, collector, mapping, topics)


def _raw_log(path: Path, collector: Collector, mapping: ChannelMap, topics: list[TopicSeries]) -> RawLog:
    notes = [*collector.notes, *(n for t in topics for n in t.notes), *_notes_of_delay(topics, mapping.stamp)]
    stamps = {signal: (t, t.stamps(source, mapping.stamp)) for t in topics for signal, source in t.sources.items()}
    origin = min(int(s[0]) for _, s in stamps.values())
    series = {signal: t.series(signal, s, origin) for signal, (t, s) in stamps.items()}
    notes.append(Note("time_origin", f"time 0 is {origin / 1e9:.9f} s of the bag's clock", {"origin_ns": origin}))
    return RawLog(path.name if path.is_dir() else path.stem, series, tuple(notes), one_clock=False)


def check_not_empty(path: Path, collector: Collector) -> None:
    """Raise LogError for a bag without messages."""
    known, wanted = collector.connections, collector.wanted
    has_messages = any(packets.stamps for packets in collector.packets.values())
    if known and (has_messages or (wanted is not None and wanted - known.keys())):
        return
    damage, topics = (
        next((n.message for n in collector.notes if n.code in ("truncated", "damaged")), ""),
        ", ".join(sorted(known)),
    )
    if not known:
        raise LogError(f"`{path}` has no messages", found=damage or "no topics", hint=COPY_AGAIN)
    if damage:
        raise LogError(f"`{path}` holds no message that can be read", found=f"{damage}; topics {topics}", hint=COPY_AGAIN)
    hint = "check that the recorder ran: its topics and their types are all that is in the file"
    raise LogError(f"`{path}` has no messages{' on the mapped topics' * (wanted is not None)}", found=topics, hint=hint)


def _topic(path: Path, collector: Collector, signal: str, source: Source) -> None:
    topic, hint = topic_name(path, "a bag", collector.connections, signal, source), f"map `{signal}` to another topic"
    if not collector.packets[topic].stamps:
        raise LogError(f"topic `{topic}` has no messages", found="0 messages", hint=hint, signal=signal)
    if topic in collector.mixed:
        raise LogError(f"topic `{topic}` cannot be decoded", found="messages of two types", hint=hint, signal=signal)
    connection = collector.connections[topic]
    if not connection.is_decodable:
        raise undecodable(connection, signal)


def undecodable(connection: Connection, signal: str = "") -> LogError:
    """Return the error for messages in an unknown serialization."""
    return LogError(
        f"the messages of `{connection.topic}` are serialized as `{connection.serialization}`, and only `{CDR}` and `{ROS1}` are "
        "known",
        found=f"type `{connection.type_name}`",
        hint="convert it with `ros2 bag convert` where that format is installed, or record with `rmw_fastrtps_cpp`",
        signal=signal,
    )


def _notes_of_delay(topics: list[TopicSeries], requested: Stamp | None) -> list[Note]:
    """Return the note on the delay between header and receive stamps where both are used.

    Raises MappingError where the delay is so large that the stamps must be of two clocks.
    """
    by_header = {t.connection.topic: [t.stamps(s, requested) is t.header for s in t.sources.values()] for t in topics}
    late = {
        t.connection.topic: float(np.median(t.received - t.header)) / 1e9
        for t in topics
        if t.header is not None and any(by_header[t.connection.topic])
    }
    if not late or all(map(all, by_header.values())):
        return []
    worst = max(late, key=lambda t: abs(late[t]))
    if abs(late[worst]) > LATE_S:
        raise MappingError(
            f"header stamps of `{worst}` are on another clock than the recorder's: {late[worst]:.3f} s (limit {LATE_S:g} s)",
            found="topics without a header, which have receive stamps only",
            hint="write `stamp: receive` at the top of the mapping",
        )
    message = f"header stamps of {worst} are {late[worst] * 1e3:.1f} ms before the recorder's, which other topics go by"
    return [Note("stamp_latency", message, {"seconds": late[worst], "topic": worst})] if abs(late[worst]) > 1e-3 else []
