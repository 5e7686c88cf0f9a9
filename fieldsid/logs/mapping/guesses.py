"""Guesses of the signal in one column or topic of a log, from its name, its type and the size of its numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldsid.logs.channels import ATTITUDE
from fieldsid.logs.convert.conditioning import MAX_PLAUSIBLE_VALUE
from fieldsid.logs.convert.units import dimension_of
from fieldsid.logs.mapping.canonical_names import unit_in_name, unit_of_field, words_of
from fieldsid.logs.mapping.vocabulary import COMMANDED, COMPASS, LATITUDE, LONGITUDE, TIME, part_of, word_set
from fieldsid.logs.mapping.word_meaning import CANONICAL, STANDARD, meaning_of
from fieldsid.logs.reader import DEFINED, TABLE, ChannelInfo, FieldInfo
from fieldsid.logs.run import ANGLES
from fieldsid.numerics.arrays import FloatArray

_COUNTERS = word_set("seq sec nanosec secs nsecs")
NAMELESS = word_set("field data value val")
"""Words of column names that do not describe the content, so that the name of the table is used."""
_IN_BRACKETS = re.compile(r"[\[(](?!\d+[\])])[^\])]+[\])]")
_PLANAR = {
    "theta": "yaw_rad", "angular_velocity": "yaw_rate_rad_s", "linear_velocity": "surge_m_s", "x": "x_m", "y": "y_m",
}  # fmt: skip
"""The signals of a pose in the plane (x, y and one angle) and of its rates, by field."""
FRAMES = {"enu": "ENU/FLU", "flu": "ENU/FLU", "ned": "NED/FRD", "frd": "NED/FRD"}
"""Words of a name that state the frames of its numbers."""
_FRAMED = word_set("ned enu local")
"""Words of a pose whose x and y are metres: others are in degrees of latitude and longitude."""
PRESSURE, PLANE = 6.0, 5.0
"""Scores of a pressure, and of a component of a pose in the plane: between a name of one word more, and one less."""
NOTHING = 0.1
"""Score of a column that never changes."""
_PARTS_OF_QUATERNION = (
    re.compile(r"(?P<stem>.*?)(?P<part>[xyzw])(?P<end>_?\d*)$", re.IGNORECASE),
    re.compile(r"(?P<stem>.*?q(?:uat|uaternion)?s?[_.]?[\[(]?)(?P<part>[0-4])(?P<end>[\])]?)$", re.IGNORECASE),
)
"""Names of the components of a quaternion: letters, or numbers after a `q`, as in `q[0]` and `quat_1`."""
UNIT_LENGTH = 0.02
"""Largest deviation of the median norm of a quaternion from one."""


@dataclass(frozen=True, slots=True)
class Guess:
    """A possible signal of a column or field, its score `sure`, its line in a mapping, and whether a format defines its unit."""

    signal: str
    sure: float
    item: dict[str, Any]
    count: int
    defined: bool = False


def of_column(channel: ChannelInfo, place: str | int) -> Iterator[Guess]:
    """Yield the guesses for a column; a column of text is no signal."""
    if channel.kind == "number":
        yield from _of_number(channel, channel.fields[0], {"column": place}, channel.name)


def _of_number(
    channel: ChannelInfo, info: FieldInfo, item: dict[str, Any], name: str, *, of_message: bool = False
) -> Iterator[Guess]:
    """Yield the guess for the numbers of a column, or of a field of messages, from a name."""
    first = [float(v) for v in info.first if isinstance(v, (int, float))]
    span = info.span or ((min(first), max(first)) if first else None)
    signal, sure = meaning_of(name, span, channel.unit) or (TIME, 0)
    is_stamp = span is not None and min(map(abs, span)) > MAX_PLAUSIBLE_VALUE
    if signal == TIME or is_stamp or not channel.count or (of_message and signal in (LATITUDE, LONGITUDE)):
        return
    unit_text = channel.unit
    unit = unit_of_field(channel.name, info.path, signal, unit_text) if of_message else unit_in_name(name, signal, unit_text)
    is_compass = of_message and signal in ("yaw_rad", "yaw_goal_rad") and COMPASS & set(words_of(f"{channel.name} {info.path}"))
    name_frame = next((frame for word, frame in FRAMES.items() if word in words_of(name)), "NED/FRD" if is_compass else None)
    how = ({} if unit is None else {"unit": unit}) | ({} if name_frame is None else {"frame": name_frame})
    moves = info.span is None or info.span[0] < info.span[1]
    is_defined = of_message and sure == STANDARD and signal not in ANGLES
    sure += is_defined and channel.kind.endswith("Imu")
    yield Guess(signal, sure if moves else NOTHING, item | how, channel.count, defined=is_defined)


def quaternion_of(names: Sequence[str], columns: Mapping[str | int, FloatArray]) -> dict[str, Any] | None:
    """Return the line of a quaternion: four columns with names that differ in the component only, and of norm one; else None.

    Where the components are numbered, the real one is first or last. A vehicle is upright more often than on its side, so the
    components of roll and pitch are small, which identifies the order.
    """
    stems: dict[tuple[str, str], dict[str, str]] = {}
    for pattern in _PARTS_OF_QUATERNION:
        for name in names:
            found = pattern.match(name.strip())
            if found and name in columns and not (COMMANDED | {"d", "delta"}) & set(words_of(name)):
                stems.setdefault((found["stem"], found["end"]), {})[found["part"].lower()] = name
    for parts in stems.values():
        picked = [parts[part] for part in ("xyzw" if "x" in parts else sorted(parts)) if part in parts]
        numbers = np.stack([columns[c] for c in picked])
        lengths = np.linalg.norm(numbers, axis=0)
        seen = lengths[np.isfinite(lengths)]
        if len(picked) == 4 and seen.size and abs(float(np.median(seen)) - 1.0) < UNIT_LENGTH:
            size = np.nanmean(numbers**2, axis=1)
            is_real_first = "x" not in parts and size[1] + size[2] <= size[0] + size[1]
            return {"columns": picked} | ({"order": "wxyz"} if is_real_first else {})
    return None


def of_topic(channel: ChannelInfo) -> Iterator[Guess]:
    """Yield the guesses for the fields of a topic."""
    for info in channel.fields:
        if info.means is not None:
            signal, how = info.means
            yield Guess(signal, CANONICAL, {"topic": channel.name, "field": info.path, **how}, channel.count, defined=True)
        elif channel.kind == TABLE:
            yield from _of_table(channel, info)
        elif channel.kind != DEFINED:
            yield from _of_field(channel, info)


def _of_table(channel: ChannelInfo, info: FieldInfo) -> Iterator[Guess]:
    """Yield the guesses for a column of one of several tables: from its name, or from that of the table where it has none."""
    words = words_of(info.path)
    is_nameless = set(words) <= NAMELESS or (len(words) == len("".join(words)) == 1)
    of_both = f"{info.path} {channel.name.partition('[')[0]}"
    name = of_both if is_nameless and (found := meaning_of(of_both)) is not None and found[1] > 1 else info.path
    for guess in _of_number(channel, info, {"topic": channel.name, "field": info.path}, name) if info.kind == "number" else ():
        # a unit in brackets that does not fit the signal shows that the column is another signal
        has_other = _IN_BRACKETS.search(name) is not None and unit_in_name(name, guess.signal) is None
        if not (has_other and dimension_of(guess.signal) is not None):
            yield guess


def _of_field(channel: ChannelInfo, info: FieldInfo) -> Iterator[Guess]:
    """Yield the guesses for a field of a message: a quaternion, a component of a pose in the plane, or a signal by its name."""
    parent, _, last = info.path.rpartition(".")
    if last in _COUNTERS or "covariance" in info.path or "[" in parent or info.path.startswith(("velocity[", "effort[")):
        return
    words, paths, count = set(words_of(channel.name)), {f.path for f in channel.fields}, channel.count
    is_wanted, item = bool(COMMANDED & words), {"topic": channel.name, "field": info.path}
    of_four = [f for f in channel.fields if f.path.rpartition(".")[0] == parent]
    if {"x", "y", "theta"} <= paths and "z" not in paths and info.path in _PLANAR:
        # of a commanded pose only the angle is a signal: the heading setpoint
        signal = "yaw_goal_rad" if is_wanted else _PLANAR[info.path]
        if not is_wanted or last == "theta":
            yield Guess(signal, PLANE + bool(_FRAMED & words), item, count)
    elif info.path == "q[0]" and {"q[1]", "q[2]", "q[3]"} <= paths and not is_wanted:
        # the messages of PX4 have the real part first
        yield Guess(ATTITUDE, STANDARD, {**item, "field": "q", "order": "wxyz"}, count, defined=True)
    elif last == "w" and {"x", "y", "z"} <= {f.path.rpartition(".")[2] for f in of_four} and not is_wanted:
        if any(f.first and f.first[0] for f in of_four):  # a driver without an attitude writes zeros
            yield Guess(ATTITUDE, STANDARD + channel.kind.endswith("Imu"), {**item, "field": parent}, count, defined=True)
    elif info.path == "fluid_pressure":
        yield Guess("depth_m", PRESSURE, {**item, "unit": "Pa"}, count)
    elif last not in ("x", "y", "z", "w") or (part_of(info.path) is not None and not is_wanted):
        name = info.path if info.path not in ("data", "vector", "position[0]") else ""
        yield from _of_number(channel, info, item, f"{channel.name} {name}".strip(), of_message=True)
