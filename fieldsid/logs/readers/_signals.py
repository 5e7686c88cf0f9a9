"""The mapped signals of a bag: fields decoded, stamps of the header or of the recorder, seconds from the first one."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.channels import ATTITUDE, ChannelMap, Source, Stamp
from fieldsid.logs.names import unit_in_name
from fieldsid.logs.reader import RawLog, ReadOptions, Series
from fieldsid.logs.readers._layout import Decoder, Layout, as_floats, numbers_at
from fieldsid.logs.readers._packets import Catch, Link
from fieldsid.logs.readers._types import decoder_of
from fieldsid.logs.run import Note
from fieldsid.registry import near

Stamps = npt.NDArray[np.int64]
HEADER, TIME = "std_msgs/msg/Header", "builtin_interfaces/msg/Time"
PRESSURE = "sensor_msgs/msg/FluidPressure"
LATE_S = 1.0
"""Header and receive stamps further apart than this are two clocks, not a delay."""


def signals_of(path: Path, catch: Catch, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the series that a mapping names."""
    if not catch.wanted and mapping.sources:
        _topic(path, catch, *next(iter(mapping.sources.items())))
    check_not_empty(path, catch)
    groups: dict[str, dict[str, Source]] = defaultdict(dict)
    for signal, source in mapping.sources.items():
        groups[_topic(path, catch, signal, source)][signal] = source
    topics = [_Topic(t, catch, options, mapping, s) for t, s in groups.items()]
    notes = [*catch.notes, *(n for t in topics for n in t.notes), *_two_clocks(topics)]
    origin = min(int(t.stamps(s)[0]) for t in topics for s in t.sources.values())
    series = {signal: t.series(signal, origin) for t in topics for signal in t.sources}
    notes.append(Note("time_origin", f"time 0 is {origin / 1e9:.9f} s of the bag's clock", {"origin_ns": origin}))
    return RawLog(path.name if path.is_dir() else path.stem, series, tuple(notes), one_clock=False)


def check_not_empty(path: Path, catch: Catch) -> None:
    """Raise LogError for a bag without messages."""
    if not catch.links:
        cut = next((n.message for n in catch.notes if n.code == "truncated"), "no topics")
        raise LogError(f"`{path}` has no messages", found=cut, hint="copy it from the vehicle again")
    if any(slot.stamps for slot in catch.slots.values()) or (catch.wanted is not None and catch.wanted - catch.links.keys()):
        return
    topics = ", ".join(sorted(catch.links)) or "no topics"
    what = "has no messages" if catch.wanted is None else "has no messages on the mapped topics"
    raise LogError(
        f"`{path}` {what}",
        found=topics,
        hint="check that the recorder ran: its topics and their types are all that is in the file",
    )


def _topic(path: Path, catch: Catch, signal: str, source: Source) -> str:
    if source.topic is None:
        raise MappingError(
            f"`{signal}` is mapped to a {source.label}, but `{path}` is a bag",
            found=source.label,
            hint="name a `topic` and a `field`",
        )
    if source.topic not in catch.links:
        raise MappingError(
            f"`{path}` has no topic `{source.topic}` for `{signal}`",
            found=", ".join(sorted(catch.links)) or "no topics",
            hint=near(source.topic, list(catch.links)),
        )
    if not catch.slots[source.topic].stamps:
        raise LogError(f"topic `{source.topic}` has no messages", found="0 messages", hint=f"map `{signal}` to another topic")
    link = catch.links[source.topic]
    if link.encoding == "other" or source.topic in catch.mixed:
        found = "messages of two types" if source.topic in catch.mixed else f"type {link.type_name}, not CDR"
        raise LogError(f"topic `{source.topic}` cannot be decoded", found=found, hint=f"map `{signal}` to another topic")
    return source.topic


class _Topic:
    """One topic's messages, decoded once for all the signals it carries."""

    def __init__(self, topic: str, catch: Catch, options: ReadOptions, mapping: ChannelMap, sources: dict[str, Source]) -> None:
        link, slot = catch.links[topic], catch.slots[topic]
        self.link = link
        self.mapping = mapping
        self.sources = sources
        decoder, note = decoder_of(link, slot.payloads[0], options.msg_path)
        self.notes: list[Note] = [] if note is None else [note]
        layout = decoder.layout(slot.payloads[0])
        self.paths = {signal: field_of(link, layout, signal, source.path) for signal, source in sources.items()}
        header = header_of(decoder)
        stamp_paths = [f"{header}.sec", f"{header}.nanosec"] if header else []
        columns = decoder.decode(slot.payloads, [*self.paths.values(), *stamp_paths])
        self.values = dict(zip(self.paths, map(as_floats, columns), strict=False))
        self.received = np.asarray(slot.stamps, dtype=np.int64)
        self.header: Stamps | None = None
        if header:
            sec, nanosec = (c[:, 0].astype(np.int64) for c in columns[-2:])
            self.header = sec * 1_000_000_000 + nanosec
        self._check(layout)

    def stamps(self, source: Source) -> Stamps:
        """Return the stamps in ns that a source goes by."""
        asked: Stamp | None = source.stamp or self.mapping.stamp
        if asked == "receive":
            return self.received
        if self.header is not None and bool(self.header.any()):
            return self.header
        if source.stamp == "header":
            found = "stamps that are all zero" if self.header is not None else f"{self.link.type_name} has no header"
            raise MappingError(f"topic `{self.link.topic}` has no header stamps", found=found, hint="use `stamp: receive`")
        return self.received

    def series(self, signal: str, origin: int) -> Series:
        """Return one signal's series, in seconds from `origin`."""
        source, path = self.sources[signal], self.paths[signal]
        stated = (
            "Pa"
            if self.link.type_name == PRESSURE
            else unit_in_name(path.rpartition(".")[2], signal)
            if signal != ATTITUDE
            else None
        )
        label = f"{self.link.topic}.{path}" if path else self.link.topic
        return Series((self.stamps(source) - origin) / 1e9, self.values[signal], label, stated, path.rpartition(".")[2] == "z")

    def _check(self, layout: Layout) -> None:
        for signal, path in self.paths.items():
            if not np.isfinite(self.values[signal]).any() and not numbers_at(layout, path):
                row = layout.leaves[path.rpartition("[")[0]]
                raise MappingError(
                    f"`{path}` of topic `{self.link.topic}` is beyond the end",
                    found=f"{row.count} elements",
                    hint=f"map `{signal}` to another one",
                )
        if self.header is not None and not self.header.any():
            self.notes.append(Note("no_header_stamp", f"{self.link.topic}: header stamps are zero, receive stamps are used", {}))


def field_of(link: Link, layout: Layout, signal: str, path: str) -> str:
    """Return the path of a signal inside a message, filled in where the type leaves no choice."""
    if not path and link.type_name == PRESSURE:
        return "fluid_pressure"
    if not path and "data" in layout.leaves:
        return "data"
    if not path and signal == ATTITUDE:
        found = quaternions_in(layout)
        if len(found) == 1:
            return found[0]
    places = numbers_at(layout, path)
    if signal == ATTITUDE and len(places) != 4:
        raise MappingError(
            f"`{ATTITUDE}` needs a quaternion, not `{path}` of `{link.topic}`",
            found=f"quaternions: {', '.join(quaternions_in(layout)) or 'none'}",
            hint="give the field that holds x, y, z, w",
        )
    if len(places) == 4 and signal not in (ATTITUDE, "yaw_rad", "pitch_rad", "roll_rad"):
        raise MappingError(
            f"`{signal}` cannot come from a quaternion", found=f"{link.topic}.{path}", hint=f"name one number: `{path}.x`"
        )
    return path


def quaternions_in(layout: Layout) -> list[str]:
    """Return the paths that hold x, y, z and w."""
    parents = dict.fromkeys(p.rpartition(".")[0] for p in layout.leaves if p.endswith(".w"))
    return [p for p in parents if all(f"{p}.{part}" in layout.leaves for part in "xyzw")]


def header_of(decoder: Decoder) -> str | None:
    """Return the path of a message's own stamp, or None."""
    for name, (_, what) in decoder.definitions[decoder.type_name]:
        if what == HEADER:
            return f"{name}.stamp"
        if what == TIME and name == "stamp":
            return name
    return None


def _two_clocks(topics: list[_Topic]) -> list[Note]:
    """Refuse header stamps of one clock beside receive stamps of another; note a plain delay."""
    late: dict[str, float] = {}
    receive = False
    for topic in topics:
        for source in topic.sources.values():
            by_header = topic.header is not None and topic.stamps(source) is topic.header
            receive |= not by_header
            if topic.header is not None and by_header:
                late[topic.link.topic] = float(np.median(topic.received - topic.header)) / 1e9
    if not late or not receive:
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


def first_values(layout: Layout, raw: bytes) -> dict[str, Any]:
    """Return every number of one message by path; rows of numbers up to eight elements."""
    found: dict[str, Any] = {}
    for path, leaf in layout.leaves.items():
        if leaf.count is None:
            found[path] = np.frombuffer(raw, leaf.dtype, 1, leaf.offset)[0].item()
            continue
        names = _names_beside(layout, path)
        for i, value in enumerate(np.frombuffer(raw, leaf.dtype, leaf.count, leaf.offset)[:8]):
            found[f"{path}[{names[i] if i < len(names) else i}]"] = value.item()
    return found


def _names_beside(layout: Layout, path: str) -> tuple[str, ...]:
    parent = path.rpartition(".")[0]
    return layout.texts.get(f"{parent}.name" if parent else "name", ())
