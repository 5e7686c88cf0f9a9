"""What is in a bag: topics with their type, count and rate, and the first values of every number inside."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.reader import ChannelInfo, FieldInfo, Inventory, ReadOptions
from fieldsid.logs.readers._packets import Catch, Link, Slot
from fieldsid.logs.readers._signals import check_not_empty, first_values
from fieldsid.logs.readers._types import decoder_of
from fieldsid.logs.run import Note


def contents_of(path: Path, catch: Catch, options: ReadOptions) -> Inventory:
    """Return the inventory of a bag whose topics were all caught; raises LogError for a bag without messages."""
    check_not_empty(path, catch)
    notes = list(catch.notes)
    channels = []
    for topic in sorted(catch.links):
        link = catch.links[topic]
        slot = catch.slots.get(topic, Slot())
        channels.append(_channel(link, slot, options, notes))
    stamps = [s for slot in catch.slots.values() for s in (slot.stamps[:1] + slot.stamps[-1:])]
    duration = (max(stamps) - min(stamps)) / 1e9 if stamps else 0.0
    form = {"ros1": "ROS 1 bag", "cdr": "ROS 2 bag"}.get(next((k.encoding for k in catch.links.values()), ""), "bag")
    return Inventory(path, form, duration, tuple(channels), notes=tuple(notes))


def _channel(link: Link, slot: Slot, options: ReadOptions, notes: list[Note]) -> ChannelInfo:
    fields: tuple[FieldInfo, ...] = ()
    if slot.payloads and link.encoding != "other":
        try:
            decoder, note = decoder_of(link, slot.payloads[0], options.msg_path)
            values = first_values(decoder.layout(slot.payloads[0]), slot.payloads[0])
            fields = tuple(FieldInfo(p, type(v).__name__, (v,)) for p, v in values.items())
        except LogError as error:
            note = Note("definition", f"{link.topic}: {error.what}", {"topic": link.topic})
        notes += [] if note is None else [note]
    steps = np.diff(np.asarray(slot.stamps, dtype=np.int64))
    period = float(np.median(steps)) / 1e9 if steps.size else 0.0
    rate = 1.0 / period if period > 0.0 else float("nan")
    return ChannelInfo(link.topic, link.type_name, len(slot.stamps), rate, fields)
