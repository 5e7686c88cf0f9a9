"""Bags by rosbags' own code: for whatever the readers of this room do not know."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag1 import ReaderError as Ros1ReaderError
from rosbags.rosbag2 import Reader as Ros2Reader
from rosbags.rosbag2 import ReaderError as Ros2ReaderError
from rosbags.typesys import TypesysError

from fieldsid.errors import LogError
from fieldsid.logs.readers.bags.packets import ROS1, Collector, Connection, UnknownFormError

FAILURES = (
    Ros1ReaderError, Ros2ReaderError, TypesysError, AssertionError, KeyError, ValueError, IndexError, OSError,
    OverflowError, MemoryError,
)  # fmt: skip
"""What rosbags raises on a file it cannot read; it asserts, indexes and believes any length where a file breaks its rules."""
_LANGUAGES = {MessageDefinitionFormat.MSG: "msg", MessageDefinitionFormat.IDL: "idl"}


def collect(path: Path, collector: Collector, because: UnknownFormError) -> None:
    """Read every message of one file into `collector`; raises LogError when rosbags cannot read it either."""
    is_ros1 = path.suffix == ".bag"
    try:
        with (Ros1Reader if is_ros1 else Ros2Reader)(path) as reader:
            packets = {c.id: collector.connect(_connection(c, is_ros1=is_ros1)) for c in reader.connections}
            wanted = [c for c in reader.connections if packets[c.id] is not None]
            for connection, stamp, payload in reader.messages(wanted) if wanted else ():
                place: Any = packets[connection.id]
                place.stamps.append(stamp)
                place.payloads.append(bytes(payload))
                collector.has_read(len(payload))
    except FAILURES as error:
        raise LogError(because.what, found=f"{because.found}; rosbags: {error}", hint=because.hint) from error


def _connection(found: Any, *, is_ros1: bool) -> Connection:
    serialization = ROS1 if is_ros1 else found.ext.serialization_format
    language: Any = _LANGUAGES.get(found.msgdef.format, "")
    return Connection(found.topic, found.msgtype, serialization, found.msgdef.data, language)
