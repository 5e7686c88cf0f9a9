"""Read ArduPilot logs by pymavlink (extra `ardupilot`): DataFlash .bin of the vehicle or its text form, telemetry .tlog."""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.logs.convert.servo_counts import COUNTS, SERVOS
from fieldsid.logs.convert.times.time_column import YEARS_S
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers._topics import Means, Topic, Topics, library, silenced, topic_of, topic_reader
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import DATAFLASH, head_of, unreadable

MAVLINK = (0xFE, 0xFD)
"""First byte of a packet in either version of the protocol; in a .tlog it follows eight bytes of time."""
FORMAT, FORMAT_LENGTH = 128, struct.calcsize("<3sBB4s16s64s")
"""Kind of the message that defines another, and its bytes: head, kind, length, name, types and columns."""
PARAMETERS = {"PARM": ("Name", "Value"), "PARAM_VALUE": ("param_id", "param_value")}
"""Messages of the vehicle's parameters, with the fields of their name and value."""
TEXT = re.compile(rb"^FMT, ?128,", re.MULTILINE)
"""Start of the first line of the text form of a DataFlash log, which ground stations write."""
_DEG, _DEG_S, _RAD, _RAD_S = ({"unit": unit} for unit in ("deg", "deg/s", "rad", "rad/s"))
MEANS: Means = {
    "ATT.Yaw": ("yaw_rad", _DEG), "ATT.Pitch": ("pitch_rad", _DEG), "ATT.Roll": ("roll_rad", _DEG),
    "ATT.DesYaw": ("yaw_goal_rad", _DEG), "ATT.DesPitch": ("pitch_goal_rad", _DEG),
    "RATE.Y": ("yaw_rate_rad_s", _DEG_S), "RATE.P": ("pitch_rate_rad_s", _DEG_S), "RATE.R": ("roll_rate_rad_s", _DEG_S),
    "IMU.GyrZ": ("yaw_rate_rad_s", _RAD_S), "IMU.GyrY": ("pitch_rate_rad_s", _RAD_S), "IMU.GyrX": ("roll_rate_rad_s", _RAD_S),
    "XKF1.PN": ("x_m", {}), "XKF1.PE": ("y_m", {}), "XKF1.PD": ("depth_m", {}),
    "ATTITUDE.yaw": ("yaw_rad", _RAD), "ATTITUDE.pitch": ("pitch_rad", _RAD), "ATTITUDE.roll": ("roll_rad", _RAD),
    "ATTITUDE.yawspeed": ("yaw_rate_rad_s", _RAD_S), "ATTITUDE.pitchspeed": ("pitch_rate_rad_s", _RAD_S),
    "ATTITUDE.rollspeed": ("roll_rate_rad_s", _RAD_S),
    "LOCAL_POSITION_NED.x": ("x_m", {}), "LOCAL_POSITION_NED.y": ("y_m", {}), "LOCAL_POSITION_NED.z": ("depth_m", {}),
}  # fmt: skip
"""Signals by the definitions of the messages."""
FUNCTIONS = {19: "elevator_rad", 21: "rudder_rad", 26: "rudder_rad", 70: "thrust"}
"""Signal of an output by its parameter SERVOn_FUNCTION: elevator, rudder, ground steering, throttle."""
PULSES = {"RCOU": "C{}", "SERVO_OUTPUT_RAW": "servo{}_raw"}
"""Messages with the outputs' pulses, and the name of the field of the n-th output."""
Rows = dict[str, list[tuple[float, dict[str, float]]]]
"""Messages by name, each with its time in s and its numbers."""


def _outputs(parameters: Mapping[str, float]) -> dict[str, tuple[str, Mapping[str, Any]]]:
    """Return the signals of the outputs by the vehicle's parameters, with the pulse at which each is centred."""
    found: dict[str, tuple[str, Mapping[str, Any]]] = {}
    for name, function in parameters.items():
        number = name.removeprefix("SERVO").removesuffix("_FUNCTION")
        signal = FUNCTIONS.get(int(function)) if name == f"SERVO{number}_FUNCTION" else None
        if signal is not None:
            centre = parameters.get(f"SERVO{number}_TRIM", SERVOS[1].centre)
            sign = {"sign": -1} if parameters.get(f"SERVO{number}_REVERSED", 0.0) else {}
            keys = {"unit": COUNTS, "centre": int(centre), **sign}
            found |= {f"{message}.{field.format(number)}": (signal, keys) for message, field in PULSES.items()}
    return found


def sniff(path: Path) -> bool:
    """Whether a file starts like a DataFlash log, binary or text, or with a time and a MAVLink packet."""
    head = head_of(path)
    if head.startswith(DATAFLASH) or TEXT.search(head):
        return True
    return len(head) >= 9 and head[8] in MAVLINK and YEARS_S[0] < 1e-6 * int.from_bytes(head[:8], "big") < YEARS_S[1]


def _topics(path: Path, options: ReadOptions, wanted: frozenset[str]) -> Topics:
    """Return all topics and their meaning: by the definitions of the messages, for outputs by the vehicle's parameters.

    Raises LogError for a damaged file, or without pymavlink.
    """
    head = head_of(path)
    is_flash = head.startswith(DATAFLASH) or TEXT.search(head) is not None
    what = "a DataFlash log (ArduPilot)" if is_flash else "a telemetry log (MAVLink)"
    mavutil = library("pymavlink.mavutil", path, what, "ardupilot")
    try:
        with silenced(), closing(mavutil.mavlink_connection(str(path)) if not is_flash else _opened_flash(path)) as log:
            rows, parameters = _rows(log, is_flash=is_flash)
    except Exception as error:  # pymavlink raises exactly this class for a format it does not know
        raise unreadable(path, f"{what} that cannot be read", error) from error
    topics = {name: _topic_of_messages(messages) for name, messages in rows.items()}
    return Topics(topics, {**MEANS, **_outputs(parameters)}, _cut(path))


def _rows(log: Any, *, is_flash: bool) -> tuple[Rows, dict[str, float]]:
    """Return the messages by name, and the vehicle's parameters."""
    rows: Rows = {}
    parameters: dict[str, float] = {}
    while (message := log.recv_match()) is not None:
        if message.get_type() == "BAD_DATA":
            continue
        if message.get_type() in PARAMETERS:
            name, value = (getattr(message, field) for field in PARAMETERS[message.get_type()])
            parameters[str(name)] = float(value)
        fields = {k: v for k, v in message.to_dict().items() if isinstance(v, (int, float)) and not isinstance(v, bool)}
        name, time = _of_flash(message, fields) if is_flash else _of_packet(message)
        if time is not None and fields:
            rows.setdefault(name, []).append((time, fields))
    return rows, parameters


def _opened_flash(path: Path) -> Any:
    forms = library("pymavlink.DFReader", path, "a DataFlash log (ArduPilot)", "ardupilot")
    reader = forms.DFReader_binary if head_of(path).startswith(DATAFLASH) else forms.DFReader_text
    # The compiled index of pymavlink writes a line for each damaged byte to file descriptor 2, which `silenced` does not reach.
    kind: Any = type("Quiet", (reader,), {"init_arrays_fast": reader.init_arrays})  # the text form has no compiled index
    log = kind.__new__(kind)
    try:
        kind.__init__(log, str(path))
    except Exception:
        # it opens the file before it reads the format, and leaves it open after an error
        if (handle := getattr(log, "filehandle", None)) is not None:
            handle.close()
        raise
    return log


def _of_flash(message: Any, body: dict[str, float]) -> tuple[str, float | None]:
    """Return the name and the time in s of a DataFlash message; remove its time and instance from its numbers `body`."""
    stamp, unit_s = (body.pop("TimeUS"), 1e-6) if "TimeUS" in body else (body.pop("TimeMS", None), 1e-3)
    # A format without units does not state which field is the number of the sensor: then it is `I`, next after the time.
    instance = getattr(message.fmt, "instance_field", None) or ("I" if list(message.fmt.columns[1:2]) == ["I"] else None)
    name = f"{message.get_type()}[{int(body.pop(instance))}]" if instance in body else message.get_type()
    return name, None if stamp is None else float(stamp) * unit_s


def _of_packet(message: Any) -> tuple[str, float]:
    return message.get_type(), float(message._timestamp)  # noqa: SLF001 - pymavlink's only name for the log's time


def _cut(path: Path) -> tuple[Note, ...]:
    """Return the note that a DataFlash log is cut off inside a message, by the lengths that it states for its formats."""
    data = path.read_bytes()
    if not data.startswith(DATAFLASH):
        return ()
    lengths, at = {FORMAT: FORMAT_LENGTH}, 0
    while at + 3 <= len(data) and data[at : at + 2] == DATAFLASH[:2] and data[at + 2] in lengths:
        if data[at + 2] == FORMAT and at + 5 <= len(data):
            lengths[data[at + 3]] = max(data[at + 4], 3)
        at += lengths[data[at + 2]]
    return () if at == len(data) else (Note("truncated", f"the log is damaged or cut off at byte {min(at, len(data))}", {}),)


def _topic_of_messages(messages: list[tuple[float, dict[str, float]]]) -> Topic | None:
    names = messages[0][1]
    fields = {n: np.array([m.get(n, np.nan) for _, m in messages], dtype=np.float64) for n in names}
    return topic_of(np.array([t for t, _ in messages]), fields)


READER = topic_reader(
    "ardupilot",
    "ArduPilot log: .bin, its text form .log, .tlog, with the extra `ardupilot`",
    (".bin", ".BIN", ".log", ".tlog"),
    "ArduPilot log",
    sniff,
    _topics,
)
