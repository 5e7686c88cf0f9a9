"""What is in a bag: topics with their type, count and rate, and the first values of every number inside."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.reader import MOST_CHANNELS, ChannelInfo, FieldInfo, Inventory, ReadOptions
from fieldsid.logs.readers.bags.messages.definitions import DefinitionSearch, decoder_of
from fieldsid.logs.readers.bags.packets import CDR, ROS1, Collector, Connection, TopicPackets
from fieldsid.logs.readers.bags.signals import check_not_empty, not_decodable
from fieldsid.logs.run import Note


def contents_of(path: Path, collector: Collector, options: ReadOptions) -> Inventory:
    """Return the inventory of a bag whose topics were all caught; raises LogError for a bag without messages."""
    check_not_empty(path, collector)
    notes = list(collector.notes)
    search = DefinitionSearch(path, options.msg_path)
    channels = []
    names = sorted(collector.connections)
    for topic in names[:MOST_CHANNELS]:
        connection = collector.connections[topic]
        packets = collector.packets[topic]
        channels.append(_channel(connection, packets, search, notes))
    stamps = [s for packets in collector.packets.values() if packets.stamps for s in (min(packets.stamps), max(packets.stamps))]
    duration = (max(stamps) - min(stamps)) / 1e9 if stamps else 0.0
    serialization = next((c.serialization for c in collector.connections.values()), "")
    form = {ROS1: "ROS 1 bag", CDR: "ROS 2 bag"}.get(serialization, "bag")
    return Inventory(path, form, duration, tuple(channels), notes=tuple(notes), more=len(names) - len(channels))


def _channel(connection: Connection, packets: TopicPackets, search: DefinitionSearch, notes: list[Note]) -> ChannelInfo:
    fields: tuple[FieldInfo, ...] = ()
    if packets.payloads and connection.is_decodable:
        try:
            decoder, note = decoder_of(connection, packets.payloads[0], search)
            values = decoder.first_values(packets.payloads[0])
            fields = tuple(FieldInfo(p, type(v).__name__, (v,)) for p, v in values.items())
        except LogError as error:
            data = {"topic": connection.topic, "found": error.found, "hint": error.hint}
            note = Note("definition", f"{connection.topic}: {error.what}; {error.hint}", data)
        notes += [] if note is None else [note]
    elif not connection.is_decodable:
        notes.append(Note("serialization", f"{connection.topic}: {not_decodable(connection)}", {"topic": connection.topic}))
    steps = np.diff(np.sort(np.frombuffer(packets.stamps, dtype=np.int64)))
    period = float(np.median(steps)) / 1e9 if steps.size else 0.0
    rate = 1.0 / period if period > 0.0 else float("nan")
    return ChannelInfo(connection.topic, connection.type_name, len(packets.stamps), rate, fields)
