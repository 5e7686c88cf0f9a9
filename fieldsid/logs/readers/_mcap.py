"""MCAP files (mcap.dev, specification 0), read from front to back without the summary: a cut-off file gives what is left.

A record is an opcode (u8), a length (u64) and that many bytes; a chunk holds more records.
"""

from __future__ import annotations

import mmap
from pathlib import Path
from struct import Struct, error

from fieldsid.logs.readers._packets import Catch, Link, Slot
from fieldsid.logs.readers._unpack import unpacked

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 3, 4, 5, 6, 15

_RECORD = Struct("<BQ")
_MESSAGE = Struct("<HIQQ")
_CHUNK = Struct("<QQQI")
_ENCODINGS = {"cdr": "cdr", "ros1": "ros1"}
_LANGUAGES = {"ros2msg": "msg", "ros1msg": "msg", "ros2idl": "idl", "omgidl": "idl"}
Bytes = bytes | mmap.mmap


def scan(path: Path, catch: Catch) -> None:
    """Read every record of a file into `catch`."""
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        records = _Records(catch)
        records.run(data, len(MAGIC), len(data))
        if not records.done:
            catch.truncated("no footer", len(data))


class _Records:
    """The records of a file, and of the chunks inside it."""

    def __init__(self, catch: Catch) -> None:
        self.catch = catch
        self.schemas: dict[int, tuple[str, str, str]] = {}
        self.slots: dict[int, Slot | None] = {}
        self.done = False

    def run(self, data: Bytes, pos: int, end: int) -> None:
        record, message = _RECORD.unpack_from, _MESSAGE.unpack_from
        slots = self.slots
        while pos + 9 <= end and not self.done:
            op, length = record(data, pos)
            pos += 9
            if pos + length > end:
                if op == CHUNK:
                    self._chunk(bytes(data[pos:end]), pos)
                return
            if op == MESSAGE and length >= 22:
                channel, _, stamp, _ = message(data, pos)
                slot = slots.get(channel)
                if slot is not None:
                    slot.take(stamp, bytes(data[pos + 22 : pos + length]))
            else:
                self._other(op, data, pos, length)
            pos += length

    def _other(self, op: int, data: Bytes, pos: int, length: int) -> None:
        if op == DATA_END:
            self.done = True
        elif op in (SCHEMA, CHANNEL, CHUNK):
            body = bytes(data[pos : pos + length])
            try:
                {SCHEMA: self._schema, CHANNEL: self._channel}.get(op, lambda b: self._chunk(b, pos))(body)
            except (error, UnicodeDecodeError):
                self.catch.damaged("a record", pos)

    def _schema(self, body: bytes) -> None:
        number = int.from_bytes(body[:2], "little")
        name, pos = _text(body, 2)
        encoding, pos = _text(body, pos)
        self.schemas[number] = (name, encoding, _text(body, pos)[0])

    def _channel(self, body: bytes) -> None:
        number, schema = int.from_bytes(body[:2], "little"), int.from_bytes(body[2:4], "little")
        if number in self.slots:
            return
        topic, pos = _text(body, 4)
        encoding, _ = _text(body, pos)
        name, language, definition = self.schemas.get(schema, ("", "", ""))
        parts = name.split("/")
        full = f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else name
        link = Link(topic, full, _ENCODINGS.get(encoding, "other"), definition, _LANGUAGES.get(language, ""))  # type: ignore[arg-type]
        self.slots[number] = self.catch.link(link)

    def _chunk(self, body: bytes, position: int) -> None:
        if len(body) < _CHUNK.size + 4:
            return
        _, _, size, _ = _CHUNK.unpack_from(body, 0)
        compression, pos = _text(body, _CHUNK.size)
        plain = unpacked(body[pos + 8 :], compression)
        if plain is None:
            self.catch.damaged("a compressed chunk", position)
            return
        self.run(plain, 0, len(plain))
        if len(plain) < size:
            self.catch.damaged("the end of a chunk", position)


def _text(body: bytes, pos: int) -> tuple[str, int]:
    (length,) = Struct("<I").unpack_from(body, pos)
    end = pos + 4 + length
    return body[pos + 4 : end].decode("utf-8", errors="replace"), end
