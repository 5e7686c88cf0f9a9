"""ArduPilot logs, read by pymavlink (extra `ardupilot`): DataFlash .bin of the vehicle, telemetry .tlog of the ground."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.convert.times.time_column import YEARS_S
from fieldsid.logs.reader import Inventory, RawLog, Reader, ReadOptions
from fieldsid.logs.readers._topics import Means, Topic, inventory_of, library, raw_log_of, topic_of, unheard
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import COPY_AGAIN, DATAFLASH

MAVLINK = (0xFE, 0xFD)
"""How a packet of either version of the protocol starts, behind eight bytes of time."""
FORMAT, FORMAT_LENGTH = 128, 89
_DEG, _DEG_S, _RAD, _RAD_S = ({"unit": unit} for unit in ("deg", "deg/s", "rad", "rad/s"))
MEANS: Means = {
    "ATT.Yaw": ("yaw_rad", _DEG), "ATT.Pitch": ("pitch_rad", _DEG), "ATT.Roll": ("roll_rad", _DEG),
    "ATT.DesYaw": ("yaw_goal_rad", _DEG), "ATT.DesPitch": ("pitch_goal_rad", _DEG),
    "RATE.Y": ("yaw_rate_rad_s", _DEG_S), "RATE.P": ("pitch_rate_rad_s", _DEG_S), "RATE.R": ("roll_rate_rad_s", _DEG_S),
    "XKF1.PN": ("x_m", {}), "XKF1.PE": ("y_m", {}), "XKF1.PD": ("depth_m", {}),
    "ATTITUDE.yaw": ("yaw_rad", _RAD), "ATTITUDE.pitch": ("pitch_rad", _RAD), "ATTITUDE.roll": ("roll_rad", _RAD),
    "ATTITUDE.yawspeed": ("yaw_rate_rad_s", _RAD_S), "ATTITUDE.pitchspeed": ("pitch_rate_rad_s", _RAD_S),
    "ATTITUDE.rollspeed": ("roll_rate_rad_s", _RAD_S),
    "LOCAL_POSITION_NED.x": ("x_m", {}), "LOCAL_POSITION_NED.y": ("y_m", {}), "LOCAL_POSITION_NED.z": ("depth_m", {}),
}  # fmt: skip
"""What the definitions of the messages say."""


def sniff(path: Path) -> bool:
    """Whether a file starts as a DataFlash log, or as a packet with its time."""
    if path.is_dir():
        return False
    with path.open("rb") as stream:
        head = stream.read(9)
    if head.startswith(DATAFLASH):
        return True
    return len(head) == 9 and head[8] in MAVLINK and YEARS_S[0] < 1e-6 * int.from_bytes(head[:8], "big") < YEARS_S[1]


def _topics(path: Path) -> dict[str, Topic]:
    with path.open("rb") as stream:
        is_flash = stream.read(3) == DATAFLASH
    what = "a DataFlash log (ArduPilot)" if is_flash else "a telemetry log (MAVLink)"
    mavutil = library("pymavlink.mavutil", path, what, "ardupilot")
    try:
        with unheard(), closing(mavutil.mavlink_connection(str(path)) if not is_flash else _flash(path)) as log:
            rows = _rows(log, is_flash=is_flash)
    except Exception as error:  # pymavlink raises this very class for a format it does not know
        found = f"{type(error).__name__}: {error}"[:160]
        raise LogError(f"`{path}` is {what} that cannot be read", found=found, hint=COPY_AGAIN) from error
    found_topics = {name: _joined(messages) for name, messages in rows.items()}
    return {name: topic for name, topic in found_topics.items() if topic is not None}


def _rows(log: Any, *, is_flash: bool) -> dict[str, list[tuple[float, dict[str, float]]]]:
    """Return the messages by name, each with its time in s and its numbers."""
    rows: dict[str, list[tuple[float, dict[str, float]]]] = {}
    while (message := log.recv_match()) is not None:
        if message.get_type() == "BAD_DATA":
            continue
        name, time, fields = _of_flash(message) if is_flash else _of_packet(message)
        if time is not None and fields:
            rows.setdefault(name, []).append((time, fields))
    return rows


def _flash(path: Path) -> Any:
    its_own = library("pymavlink.DFReader", path, "a DataFlash log (ArduPilot)", "ardupilot").DFReader_binary
    # its compiled index writes a line for each damaged byte to the process's own stderr, where nothing keeps it from the user
    kind: Any = type("Quiet", (its_own,), {"init_arrays_fast": its_own.init_arrays})
    log = kind.__new__(kind)
    try:
        kind.__init__(log, str(path))
    except Exception:
        # it opens the file before it looks into it, and leaves it open where it does not like what it finds
        if (handle := getattr(log, "filehandle", None)) is not None:
            handle.close()
        raise
    return log


def _of_flash(message: Any) -> tuple[str, float | None, dict[str, float]]:
    body = {k: v for k, v in message.to_dict().items() if isinstance(v, (int, float)) and not isinstance(v, bool)}
    stamp = body.pop("TimeUS", None)
    which = getattr(message.fmt, "instance_field", None)
    name = f"{message.get_type()}[{int(body.pop(which))}]" if which in body else message.get_type()
    return name, None if stamp is None else float(stamp) / 1e6, body


def _of_packet(message: Any) -> tuple[str, float | None, dict[str, float]]:
    body = {k: v for k, v in message.to_dict().items() if isinstance(v, (int, float)) and not isinstance(v, bool)}
    return message.get_type(), float(message._timestamp), body  # noqa: SLF001 - pymavlink's only name for the log's time


def _cut(path: Path) -> tuple[Note, ...]:
    """Return the note that a DataFlash log is cut off inside a message, by the lengths that it states of its formats."""
    data = path.read_bytes()
    if not data.startswith(DATAFLASH):
        return ()
    lengths, at = {FORMAT: FORMAT_LENGTH}, 0
    while at + 3 <= len(data) and data[at : at + 2] == DATAFLASH[:2] and data[at + 2] in lengths:
        if data[at + 2] == FORMAT and at + 5 <= len(data):
            lengths[data[at + 3]] = max(data[at + 4], 3)
        at += lengths[data[at + 2]]
    return () if at == len(data) else (Note("truncated", f"the log is damaged or cut off at byte {min(at, len(data))}", {}),)


def _joined(messages: list[tuple[float, dict[str, float]]]) -> Topic | None:
    names = messages[0][1]
    fields = {n: np.array([m.get(n, np.nan) for _, m in messages], dtype=np.float64) for n in names}
    return topic_of(np.array([t for t, _ in messages]), fields)


def inventory(path: Path, options: ReadOptions, form: TableForm) -> Inventory:
    """Return the messages with count, rate and first values; raises LogError for a damaged file, or without pymavlink."""
    return inventory_of(path, "ArduPilot log", _topics(path), MEANS, _cut(path))


def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the mapped fields; raises MappingError for one that is not there, LogError as `inventory` does."""
    return raw_log_of(path, _topics(path), mapping, _cut(path))


READER = Reader(
    name="ardupilot",
    says="ArduPilot log: .bin, .tlog, with the extra `ardupilot`",
    suffixes=(".bin", ".BIN", ".tlog"),
    sniff=sniff,
    inventory=inventory,
    read=read,
)
