"""What a version of the IMC protocol says of its messages: the IMC.xml, or IMC.xml.gz, that DUNE copies beside each log."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from xml.etree import ElementTree as ET

from fieldsid.errors import LogError
from fieldsid.logs.readers._unpacked_size import UnpackedSize
from fieldsid.logs.unknown_file import COPY_AGAIN

FILES = ("IMC.xml", "IMC.xml.gz")
NUMBERS: Mapping[str, str] = MappingProxyType(
    {"int8_t": "i1", "uint8_t": "u1", "int16_t": "i2", "uint16_t": "u2", "int32_t": "i4", "uint32_t": "u4", "int64_t": "i8",
     "fp32_t": "f4", "fp64_t": "f8"}
)  # fmt: skip
"""NumPy's types of the protocol's numbers; text, raw data and messages inside a message have no length of their own."""


@dataclass(frozen=True, slots=True)
class Message:
    """A kind of message: its name, and its numbers (name and NumPy type) before the first field of variable length."""

    name: str
    numbers: tuple[tuple[str, str], ...]


def definition_of(path: Path, folder: Path | None) -> dict[int, Message]:
    """Return the kinds of messages by number, from beside a log or from a folder; raises LogError for no definition."""
    place = folder or path.parent
    file = next((f for name in FILES if (f := place / name).is_file()), None)
    if file is None:
        raise LogError(
            f"`{path}` is an IMC log (DUNE, LSTS), and the definition of its messages is missing",
            found=f"no {' and no '.join(FILES)} in `{place}`",
            hint="copy the IMC.xml that the vehicle wrote beside the log, or name its folder: `--msg-path DIR`",
        )
    try:
        raw = file.read_bytes()
        return _messages(_unpacked(raw, file) if file.suffix == ".gz" else raw)
    except (ET.ParseError, LookupError, ValueError, zlib.error) as error:
        raise LogError(
            f"`{file}` is no definition of IMC messages", found=f"{type(error).__name__}: {error}", hint=COPY_AGAIN
        ) from error


def _unpacked(raw: bytes, file: Path) -> bytes:
    unpack, size = zlib.decompressobj(wbits=31), UnpackedSize(file)
    plain = unpack.decompress(raw, size.left + 1)
    size.add(len(plain))
    if not unpack.eof:
        raise ValueError("it is cut off")
    return plain


def _messages(text: bytes) -> dict[int, Message]:
    if b"<!ENTITY" in text:
        raise ValueError("it defines entities of its own")
    root = ET.fromstring(text)  # noqa: S314 - what could grow without bound is refused above
    return {int(m.attrib["id"]): Message(m.attrib["abbrev"], _numbers(m)) for m in root.iter("message")}


def _numbers(message: ET.Element) -> tuple[tuple[str, str], ...]:
    found: list[tuple[str, str]] = []
    for part in message.iter("field"):
        kind = NUMBERS.get(part.attrib["type"])
        if kind is None:
            break
        found.append((part.attrib["abbrev"], kind))
    if len({name for name, _ in found}) < len(found):
        raise ValueError(f"message {message.attrib['abbrev']} has a field twice")
    return tuple(found)
