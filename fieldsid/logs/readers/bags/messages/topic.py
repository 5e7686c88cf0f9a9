"""Decode the messages of one topic block by block while they are read, and keep only the numbers of the mapped fields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.channels import ATTITUDE, Source, Stamp
from fieldsid.logs.mapping.canonical_names import unit_of_field
from fieldsid.logs.reader import Series
from fieldsid.logs.readers.bags.messages.definitions import DefinitionSearch, decoder_of
from fieldsid.logs.readers.bags.messages.message_layout import Decoder, Layout, as_floats, numbers_at
from fieldsid.logs.readers.bags.packets import Connection, TopicPackets
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

Stamps = npt.NDArray[np.int64]
HEADER, TIME = "std_msgs/msg/Header", "builtin_interfaces/msg/Time"
PRESSURE = "sensor_msgs/msg/FluidPressure"
FIRST_TRIED = 5
"""Number of messages that are tried to find the fields of a topic, because the first ones may be damaged."""


@dataclass(frozen=True, slots=True)
class TopicSeries:
    """The decoded fields of one topic: values (n,) or (n, 4) by signal, receive and header stamps (n,) in ns."""

    connection: Connection
    sources: Mapping[str, Source]
    paths: Mapping[str, str]
    values: Mapping[str, FloatArray]
    received: Stamps
    header: Stamps | None
    notes: tuple[Note, ...]

    def stamps(self, source: Source, default: Stamp | None) -> Stamps:
        """Return the stamps in ns that are used for a source; raises MappingError for header stamps that are missing.

        `default` is the kind of stamps that the mapping states for all sources.
        """
        stated = source.stamp or default
        if stated == "receive":
            return self.received
        if self.header is not None and bool(self.header.any()):
            return self.header
        if source.stamp == "header":
            found = "stamps that are all zero" if self.header is not None else f"{self.connection.type_name} has no header"
            signal = next(name for name, known in self.sources.items() if known is source)
            raise MappingError(
                f"topic `{self.connection.topic}` has no header stamps", found=found, hint=f"use `stamp: receive` at `{signal}`"
            )
        return self.received

    def series(self, signal: str, stamps: Stamps, origin: int) -> Series:
        """Return one signal's series, in seconds from `origin`."""
        path = self.paths[signal]
        of_field = None if signal == ATTITUDE else unit_of_field(self.connection.topic, path, signal)
        unit = "Pa" if self.connection.type_name == PRESSURE else of_field
        label = f"{self.connection.topic}.{path}" if path else self.connection.topic
        return Series((stamps - origin) / 1e9, self.values[signal], label, unit, path.rpartition(".")[2] == "z")


class TopicDecoding:
    """Decode the payloads of one topic as they are read, and keep the mapped numbers of each."""

    def __init__(self, sources: Mapping[str, Source], search: DefinitionSearch) -> None:
        self.sources = sources
        self.search = search
        self.notes: list[Note] = []
        self.decoder: Decoder | None = None
        self.paths: dict[str, str] = {}
        self.header: str | None = None
        self.blocks: list[list[npt.NDArray[Any]]] = []
        self.good: list[npt.NDArray[np.bool_]] = []

    def settle(self, connection: Connection, packets: TopicPackets) -> None:
        """Decode the waiting payloads; raises LogError without a fitting definition, MappingError for a missing field."""
        payloads = packets.payloads
        if connection.is_decodable:
            decoder = self.decoder or self._begin(connection, payloads)
            stamp = [f"{self.header}.sec", f"{self.header}.nanosec"] if self.header else []
            columns, good = decoder.decode(payloads, [*self.paths.values(), *stamp])
            self.blocks.append(columns)
            self.good.append(good)
        payloads.clear()

    def _begin(self, connection: Connection, payloads: list[bytes]) -> Decoder:
        """Return the decoder, and set the paths of the fields, by the first message that a definition fits."""
        decoder, note, first = _first_that_fits(connection, payloads, self.search)
        layout = decoder.layout(first)
        self.paths = {signal: field_of(connection, layout, signal, source.path) for signal, source in self.sources.items()}
        self.header = header_of(decoder)
        self.notes += [] if note is None else [note]
        self.decoder = decoder
        return decoder

    def joined(self, connection: Connection, packets: TopicPackets) -> TopicSeries:
        """Return the topic in the order of its receive stamps; messages that cannot be decoded are left out with a note."""
        good = np.concatenate(self.good)
        received = np.frombuffer(packets.stamps, dtype=np.int64)[good]
        order = np.argsort(received, kind="stable")
        columns = [_joined([b[k] for b in self.blocks])[good][order] for k in range(len(self.blocks[0]))]
        values = dict(zip(self.paths, map(as_floats, columns), strict=False))
        if not good.all():
            self._note_left_out(connection, packets, good)
        header = _header_stamps(columns[-2:]) if self.header else None
        if header is not None and not header.any():
            message = f"{connection.topic}: header stamps are zero, receive stamps are used"
            self.notes.append(Note("no_header_stamp", message, {}))
        self._refuse_beyond_the_end(connection, values)
        return TopicSeries(connection, self.sources, self.paths, values, received[order], header, tuple(self.notes))

    def _note_left_out(self, connection: Connection, packets: TopicPackets, good: npt.NDArray[np.bool_]) -> None:
        bad = int((~good).sum())
        at = (packets.stamps[int(np.argmin(good))] - packets.stamps[0]) / 1e9
        message = f"{connection.topic}: {bad} of {good.size} messages do not fit their definition and were left out, "
        message += f"the first {at:.3f} s after the topic's first"
        self.notes.append(Note("damaged", message, {"topic": connection.topic, "count": bad, "of": int(good.size)}))

    def _refuse_beyond_the_end(self, connection: Connection, values: Mapping[str, FloatArray]) -> None:
        for signal, path in self.paths.items():
            if path.endswith("]") and values[signal].size and bool(np.isnan(values[signal]).all()):
                raise MappingError(
                    f"`{path}` of topic `{connection.topic}` is beyond the end, or never a number",
                    found=f"{values[signal].size} messages",
                    hint=f"map `{signal}` to another element",
                    signal=signal,
                )


def _first_that_fits(
    connection: Connection, payloads: list[bytes], search: DefinitionSearch
) -> tuple[Decoder, Note | None, bytes]:
    first: LogError | None = None
    for payload in payloads[:FIRST_TRIED]:
        try:
            return *decoder_of(connection, payload, search), payload
        except LogError as error:
            first = first or error
    raise first or LogError(f"topic `{connection.topic}` has no messages")


def _joined(blocks: list[npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """Return the concatenated blocks (n, 1) or (n, 4); a block in which the element was missing is NaN."""
    width = max(b.shape[1] for b in blocks)
    return np.concatenate([b if b.shape[1] == width else np.repeat(b, width, axis=1) for b in blocks])


def _header_stamps(columns: list[npt.NDArray[Any]]) -> Stamps:
    sec, nanosec = (c[:, 0].astype(np.int64) for c in columns)
    return sec * 1_000_000_000 + nanosec


def field_of(connection: Connection, layout: Layout, signal: str, path: str) -> str:
    """Return the path of a signal inside a message; an empty path is completed where the type allows only one."""
    if not path and connection.type_name == PRESSURE:
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
            f"`{ATTITUDE}` needs a quaternion, not `{path}` of `{connection.topic}`",
            found=f"quaternions: {', '.join(quaternions_in(layout)) or 'none'}",
            hint="give the field that holds x, y, z, w",
            signal=signal,
        )
    return path


def quaternions_in(layout: Layout) -> list[str]:
    """Return the paths that hold x, y, z and w."""
    parents = dict.fromkeys(p.rpartition(".")[0] for p in layout.leaves if p.endswith(".w"))
    return [p for p in parents if all(f"{p}.{part}" in layout.leaves for part in "xyzw")]


def header_of(decoder: Decoder) -> str | None:
    """Return the path of the stamp inside the messages of a decoder, or None where there is none."""
    for name, (_, what) in decoder.definitions[decoder.type_name]:
        if what == HEADER:
            return f"{name}.stamp"
        if what == TIME and name == "stamp":
            return name
    return None
