"""Read logs of DUNE and Neptus (LSTS), .lsf: a sequence of IMC messages, which an IMC.xml in the same folder defines.

A message is a header of 20 bytes, its fields, and the CRC-16-IBM of both (IMC protocol reference, LSTS). The header has the
synchronisation number (0xFE with the major and minor version; it shows the byte order), kind, size of the fields, time in s,
source, entity of the source, destination, and entity of the destination. Bytes between two messages are damaged and left out, as
are messages with a wrong checksum.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from xml.etree import ElementTree as ET

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.reader import MOST_DEVICES, ReadOptions
from fieldsid.logs.readers._topics import Means, Topic, Topics, topic_of, topic_reader
from fieldsid.logs.readers._unpacked import GZIP, gunzipped, inflated
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import COPY_AGAIN, head_of, imc_order
from fieldsid.numerics.arrays import FloatArray

FILES = ("IMC.xml", "IMC.xml.gz")
NUMBERS: Mapping[str, str] = MappingProxyType(
    {"int8_t": "i1", "uint8_t": "u1", "int16_t": "i2", "uint16_t": "u2", "int32_t": "i4", "uint32_t": "u4", "int64_t": "i8",
     "fp32_t": "f4", "fp64_t": "f8"}
)  # fmt: skip
"""NumPy's types of the protocol's numbers; text, raw data and messages inside a message have no fixed length."""


@dataclass(frozen=True, slots=True)
class Message:
    """A kind of message: its name, and its numbers (name and NumPy type) before the first field of variable length."""

    name: str
    numbers: tuple[tuple[str, str], ...]


def definition_of(path: Path, folder: Path | None) -> dict[int, Message]:
    """Return the kinds of messages by number, defined in `folder`, else in the folder of the log; raises LogError without one."""
    place = folder or path.parent
    file = next((f for name in FILES if (f := place / name).is_file()), None)
    if file is None:
        raise LogError(
            f"`{path}` is an IMC log (DUNE, LSTS), and the definition of its messages is missing",
            found=f"no {' and no '.join(FILES)} in `{place}`",
            hint="copy the IMC.xml that the vehicle wrote beside the log, or name its folder: `--msg-path DIR`",
        )
    try:
        return _messages(*inflated(file))
    except (ET.ParseError, LookupError, ValueError) as error:
        raise LogError(
            f"`{file}` is no definition of IMC messages", found=f"{type(error).__name__}: {error}", hint=COPY_AGAIN
        ) from error


def _messages(text: bytes, is_cut: bool) -> dict[int, Message]:  # noqa: FBT001 - as `inflated` returns them
    if is_cut:
        raise ValueError("it is cut off")
    if b"<!ENTITY" in text:
        raise ValueError("it defines entities of its own")
    root = ET.fromstring(text)  # noqa: S314 - what could grow without bound is refused above
    return {int(m.attrib["id"]): Message(m.attrib["abbrev"], _numbers_of(m)) for m in root.iter("message")}


def _numbers_of(message: ET.Element) -> tuple[tuple[str, str], ...]:
    found: list[tuple[str, str]] = []
    for part in message.iter("field"):
        kind = NUMBERS.get(part.attrib["type"])
        if kind is None:
            break
        found.append((part.attrib["abbrev"], kind))
    if len({name for name, _ in found}) < len(found):
        raise ValueError(f"message {message.attrib['abbrev']} has a field twice")
    return tuple(found)


_HEAD = "HHHdHBHB"
HEADER, FOOTER = struct.calcsize(f"<{_HEAD}"), struct.calcsize("<H")
_STATE = {
    "psi": ("yaw_rad", "rad"), "theta": ("pitch_rad", "rad"), "phi": ("roll_rad", "rad"), "r": ("yaw_rate_rad_s", "rad/s"),
    "q": ("pitch_rate_rad_s", "rad/s"), "p": ("roll_rate_rad_s", "rad/s"), "u": ("surge_m_s", "m/s"), "v": ("sway_m_s", "m/s"),
    "w": ("heave_m_s", "m/s"), "depth": ("depth_m", "m"), "x": ("x_m", "m"), "y": ("y_m", "m"),
}  # fmt: skip
MEANS: Means = {f"EstimatedState.{name}": (signal, {"unit": unit}) for name, (signal, unit) in _STATE.items()} | {
    "DesiredHeading.value": ("yaw_goal_rad", {"unit": "rad"}),
    "DesiredPitch.value": ("pitch_goal_rad", {"unit": "rad"}),
    "Rpm.value": ("propeller_rpm", {"unit": "rpm"}),
    "SetThrusterActuation.value": ("thrust", {}),
}
"""Signals by the protocol: the estimated state is in north-east-down axes, the body in forward-starboard-down axes."""


def sniff(path: Path) -> bool:
    """Whether a file, packed or not, starts with a synchronisation number."""
    head = head_of(path)
    if head.startswith(GZIP):
        try:
            head = next((piece for piece, _ in gunzipped(BytesIO(head)) if piece), b"")
        except (zlib.error, EOFError):  # not a readable gzip file, so not one for this reader
            return False
    return imc_order(head) is not None


Kinds = dict[tuple[int, int, int, int], list[int]]
"""Byte offsets of messages, by kind, source, entity and size."""


def _find_messages(data: bytes, order: str) -> tuple[Kinds, int, int]:
    """Return the offsets of the messages of each kind, the number of damaged places, and the offset of the first one."""
    head, by_kind = struct.Struct(order + _HEAD), defaultdict(list)
    sync, at, damaged, first, buffer = data[:2], 0, 0, -1, np.frombuffer(data, np.uint8)
    while at >= 0 and at + HEADER + FOOTER <= len(data):
        _, kind, size, _, source, entity, _, _ = head.unpack_from(data, at)
        end = at + HEADER + size + FOOTER
        follows = end == len(data) or data[end : end + 2] == sync
        if data[at : at + 2] == sync and end <= len(data) and (follows or _have_checksum(buffer[None, at:end], order)[0]):
            by_kind[kind, source, entity, size].append(at)
            at = end
            continue
        damaged, first = damaged + 1, at if first < 0 else first
        at = data.find(sync, at + 1)
    return by_kind, damaged + (0 <= at < len(data)), first if first >= 0 else at


def _crc_table() -> npt.NDArray[np.uint16]:
    table = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ 0xA001, table >> 1).astype(np.uint16)
    return table


CRC = _crc_table()
"""The CRC-16-IBM of each byte: x^16 + x^15 + x^2 + 1, low bit first."""


def _have_checksum(messages: npt.NDArray[np.uint8], order: str) -> npt.NDArray[np.bool_]:
    """Return a mask (n,) of the messages (n, size) whose checksum is right."""
    stated = np.ascontiguousarray(messages[:, -FOOTER:]).view(f"{order}u2")[:, 0]
    computed = np.zeros(len(messages), dtype=np.uint16)
    for column in messages[:, :-FOOTER].T:
        computed = (computed >> 8) ^ CRC[(computed ^ column) & 0xFF]
    return np.asarray(computed == stated)


def _topics(path: Path, options: ReadOptions, wanted: frozenset[str]) -> Topics:
    """Return the messages of all kinds that have numbers; raises LogError for a log without its definition."""
    kinds = definition_of(path, options.msg_path)
    data, is_cut = inflated(path)
    order = imc_order(data[:2])
    if order is None:
        raise LogError(f"`{path}` is a damaged IMC log", found="no message at its start", hint=COPY_AGAIN)
    (places, damaged, first), buffer = _find_messages(data, order), np.frombuffer(data, np.uint8)
    by_source = Counter(source for (_, source, _, _), starts in places.items() for _ in starts)
    parts: dict[tuple[int, int, int], list[tuple[FloatArray, dict[str, FloatArray]]]] = defaultdict(list)
    wrong = 0
    for (kind, source, entity, size), starts in places.items():
        layout = np.dtype([(n, f"{order}{t}") for n, t in kinds[kind].numbers]) if kind in kinds else np.dtype([])
        if not 0 < layout.itemsize <= size:
            continue
        messages = buffer[np.array(starts)[:, None] + np.arange(HEADER + size + FOOTER)]
        good = messages[_have_checksum(messages, order)]
        wrong += len(messages) - len(good)
        time = np.ascontiguousarray(good[:, 6:14]).view(f"{order}f8")[:, 0].astype(np.float64)
        numbers = np.ascontiguousarray(good[:, HEADER : HEADER + layout.itemsize]).view(layout)[:, 0]
        parts[kind, source, entity].append((time, {n: numbers[n].astype(np.float64) for n in layout.names or ()}))
    # the source of most messages is the system that wrote the log; it also records messages of others
    named = dict(_named(kinds, parts, max(by_source, key=lambda source: by_source[source], default=0)))
    return Topics(named, MEANS, _notes(damaged, wrong, first, is_cut=is_cut))


def _notes(damaged: int, wrong: int, first: int, *, is_cut: bool) -> tuple[Note, ...]:
    if not damaged + wrong and not is_cut:
        return ()
    where = f", the first at byte {first}" if damaged else ""
    cut = "; the packed file is cut off" if is_cut else ""
    message = f"messages that are damaged or cut off, left out: {damaged + wrong}{where}{cut}"
    return (Note("truncated", message, {"count": damaged + wrong}),)


def _named(
    kinds: dict[int, Message], parts: dict[tuple[int, int, int], list[tuple[FloatArray, dict[str, FloatArray]]]], logger: int
) -> Iterator[tuple[str, Topic | None]]:
    """Yield topics by name.

    The topic of the entity that sends most messages of a kind, in the system that wrote the log (`logger`), has the name of the
    message. The names of the other topics have the source, the entity or the device in brackets.
    """
    sizes = {key: sum(len(time) for time, _ in blocks) for key, blocks in parts.items()}
    for (kind, source, entity), blocks in parts.items():
        rivals = [key for key in parts if key[0] == kind and key[1] == logger]
        busiest = max(rivals, key=lambda key: sizes[key], default=None) == (kind, source, entity)
        name = kinds[kind].name
        name += "" if busiest else f"[{entity}]" if source == logger else f"[{source:#06x}.{entity}]"
        time = np.concatenate([t for t, _ in blocks])
        fields = {n: np.concatenate([f[n] for _, f in blocks]) for n in blocks[0][1]}
        devices = np.unique(fields["id"]) if "id" in fields else np.zeros(0)
        if not 1 < devices.size <= MOST_DEVICES:
            yield name, topic_of(time, fields)
            continue
        for device in devices:
            rows = fields["id"] == device
            yield f"{name}[{device:.0f}]", topic_of(time[rows], {n: v[rows] for n, v in fields.items()})


READER = topic_reader(
    "lsf", "DUNE log (LSTS): .lsf, .lsf.gz, with its IMC.xml beside it", (".lsf", ".lsf.gz"), "IMC log", sniff, _topics
)
