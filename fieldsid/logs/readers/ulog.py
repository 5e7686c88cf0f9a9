"""Read PX4 logs, .ulg, by pyulog (extra `ulog`): each topic of the flight stack with its fields, in north-east-down axes."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers._topics import Means, Topics, library, silenced, topic_of, topic_reader
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import ULOG, ULOG_HEADER, head_of, unreadable

MESSAGE_HEADER = struct.calcsize("<HB")
"""Bytes before a message's body: its length and its type."""
MEANS: Means = {
    "vehicle_attitude.q[0], q[1], q[2], q[3]": ("attitude", {"order": "wxyz"}),
    "vehicle_angular_velocity.xyz[0]": ("roll_rate_rad_s", {"unit": "rad/s"}),
    "vehicle_angular_velocity.xyz[1]": ("pitch_rate_rad_s", {"unit": "rad/s"}),
    "vehicle_angular_velocity.xyz[2]": ("yaw_rate_rad_s", {"unit": "rad/s"}),
    "vehicle_attitude_setpoint.yaw_body": ("yaw_goal_rad", {"unit": "rad"}),
    "vehicle_attitude_setpoint.pitch_body": ("pitch_goal_rad", {"unit": "rad"}),
    "vehicle_local_position.x": ("x_m", {}),
    "vehicle_local_position.y": ("y_m", {}),
    "vehicle_local_position.z": ("depth_m", {}),
    "actuator_controls_0.control[1]": ("elevator_rad", {"unit": "1"}),
    "actuator_controls_0.control[2]": ("rudder_rad", {"unit": "1"}),
    "actuator_controls_0.control[3]": ("thrust", {}),
}
"""Signals by the definitions of PX4's topics."""


def sniff(path: Path) -> bool:
    """Whether a file has the signature of ULog."""
    return head_of(path).startswith(ULOG)


def _topics(path: Path, options: ReadOptions, wanted: frozenset[str]) -> Topics:
    """Return all topics, and notes on a log that is cut off inside a message; raises LogError for damage, or without pyulog."""
    size = path.stat().st_size
    if size <= ULOG_HEADER:
        what = f"`{path}` is a ULog file (PX4) without data"
        raise LogError(what, found=f"{size} bytes: its header", hint="take another log")
    pyulog = library("pyulog", path, "a ULog file (PX4)", "ulog")
    try:
        with path.open("rb") as stream, silenced():
            log = pyulog.ULog(stream)
    except Exception as error:  # pyulog has no special class of errors for what it cannot parse
        raise unreadable(path, "a damaged ULog file", error) from error
    topics = {}
    for part in log.data_list:
        if "timestamp" not in part.data:  # the format requires it, so the definition is damaged
            continue
        fields = {n: np.asarray(v, dtype=np.float64) for n, v in part.data.items() if n != "timestamp"}
        stamps = np.asarray(part.data["timestamp"], dtype=np.float64) / 1e6
        topics[f"{part.name}[{part.multi_id}]" if part.multi_id else part.name] = topic_of(stamps, fields)
    damaged = (Note("damaged", "the log is damaged: what is no message of its definitions was left out", {}),)
    return Topics(topics, MEANS, _cut(path) + (damaged if log.file_corruption else ()))


def _cut(path: Path) -> tuple[Note, ...]:
    """Return the note that a log is cut off inside a message."""
    size, at = path.stat().st_size, ULOG_HEADER
    with path.open("rb") as stream:
        while at + MESSAGE_HEADER <= size:
            stream.seek(at)
            at += MESSAGE_HEADER + int.from_bytes(stream.read(2), "little")
    return () if at == size else (Note("truncated", "the log is cut off inside a message, which was left out", {}),)


READER = topic_reader("ulog", "PX4 log: .ulg, with the extra `ulog`", (".ulg",), "ULog", sniff, _topics)
