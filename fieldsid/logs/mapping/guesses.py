"""What one column or topic of a log may be, by its name, its type and the size of its numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldsid.logs.channels import ATTITUDE
from fieldsid.logs.convert.units import dimension_of
from fieldsid.logs.mapping.canonical_names import canonical, stated_unit, unit_in_name, unit_of_field
from fieldsid.logs.mapping.name_words import words_of
from fieldsid.logs.mapping.vocabulary import COMMANDED, LATITUDE, LONGITUDE, TIME
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import DEFINED, TABLE, ChannelInfo, FieldInfo
from fieldsid.numerics.arrays import FloatArray

_VECTORS = {
    "angular_velocity": ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s"),
    "angular": ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s"),
    "linear": ("surge_m_s", "sway_m_s", "heave_m_s"),
    "position": ("x_m", "y_m", "depth_m"),
}
_EULER = {"rpy", "euler", "attitude", "orientation", "angles"}
_COUNTERS = {"seq", "sec", "nanosec", "secs", "nsecs"}
NAMELESS = frozenset({"field", "data", "value", "val"})
"""Words of a column that is called by its table's name."""
_IN_BRACKETS = re.compile(r"[\[(](?!\d+[\])])[^\])]+[\])]")
_PLANAR = {
    "theta": "yaw_rad", "angular_velocity": "yaw_rate_rad_s", "linear_velocity": "surge_m_s", "x": "x_m", "y": "y_m",
}  # fmt: skip
"""Fields of a pose in the plane, which has an x, a y and one angle."""
_FRAMED = {"ned", "enu", "local"}
"""Words of a pose whose x and y are metres: others are in degrees of latitude and longitude."""
STANDARD = 8.0
"""What a part of a standard message is as sure as, whose unit is that of the standard: SI."""
NOTHING = 0.1
"""What a column that never changes is as sure as, beside one that does."""


@dataclass(frozen=True, slots=True)
class Guess:
    """A signal that a column or field may be, how sure that is, and how it is read; `defined` where a format says its unit."""

    signal: str
    sure: float
    item: dict[str, Any]
    count: int
    defined: bool = False


def of_column(channel: ChannelInfo, place: str | int) -> Iterator[Guess]:
    """Yield what a column may be; one of words is no signal."""
    found = _of_message_path(channel.name) or meaning_of(channel.name, channel.fields[0].span)
    if found is None or channel.count == 0 or channel.kind != "number" or found[0] == TIME:
        return
    signal, sure = found
    span = channel.fields[0].span
    sure = sure if span is None or span[0] < span[1] else NOTHING
    said = canonical(channel.name)
    unit = said.unit if said is not None else None if signal in (LATITUDE, LONGITUDE) else unit_in_name(channel.name, signal)
    if unit is None and channel.unit and signal not in (LATITUDE, LONGITUDE):
        unit = stated_unit(channel.unit, signal)
    yield Guess(signal, sure, {"column": place} | ({"unit": unit} if unit not in (None, "1") else {}), channel.count)


def _of_message_path(name: str) -> tuple[str, float] | None:
    """Return what the path of a standard message's vector says that is a column's name, as in `field.twist.twist.angular.z`."""
    parent, _, last = name.rpartition(".")
    vector = parent.rpartition(".")[2]
    if last not in ("x", "y", "z") or vector not in _VECTORS or COMMANDED & set(words_of(name)):
        return None
    return _VECTORS[vector]["xyz".index(last)], 8.0


_PARTS_OF_QUATERNION = (
    re.compile(r"(?P<stem>.*?)(?P<part>[xyzw])(?P<end>_?\d*)$", re.IGNORECASE),
    re.compile(r"(?P<stem>.*?q(?:uat|uaternion)?s?[_.]?[\[(]?)(?P<part>[0-4])(?P<end>[\])]?)$", re.IGNORECASE),
)
"""How the parts of a quaternion are called: by their letters, or counted behind a `q` as in `q[0]` and `quat_1`."""
UNIT_LENGTH = 0.02
"""How far the length of a quaternion's four numbers may be from one."""


def quaternion_of(names: Sequence[str], columns: Mapping[str | int, FloatArray]) -> dict[str, Any] | None:
    """Return the four columns of an attitude: alike in name but for the part, together of length one; None where there are none.

    Of parts that are counted the real one is first or last: a vehicle is upright more often than on its side, so that the two
    that are no turn about the vertical are small.
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
    """Yield what the fields of a topic may be."""
    if channel.kind == TABLE:
        yield from _of_table(channel)
        return
    commanded = bool(COMMANDED & set(words_of(channel.name)))
    preferred = 1.0 if channel.kind.endswith("Imu") else 0.0
    paths = {info.path for info in channel.fields}
    planar = {"x", "y", "theta"} <= paths and "z" not in paths
    for info in channel.fields:
        parent, _, last = info.path.rpartition(".")
        if info.means is not None:
            yield _of_format(channel, info, *info.means)
            continue
        if channel.kind == DEFINED or last in _COUNTERS or "covariance" in info.path or "[" in parent:
            continue
        if info.path == "q[0]" and {"q[1]", "q[2]", "q[3]"} <= paths and not commanded:
            # the messages of PX4 have the real part first
            yield Guess(ATTITUDE, 8.0, {"topic": channel.name, "field": "q", "order": "wxyz"}, channel.count, defined=True)
        if planar and info.path in _PLANAR:
            yield from _of_plane(channel, info.path, commanded=commanded)
            continue
        signal, sure = _of_vector(channel, parent, last, commanded=commanded)
        if signal is None:
            yield from _of_scalar(channel, info)
        elif not (signal == ATTITUDE and _is_nothing(channel, parent)):
            path = parent if signal == ATTITUDE else info.path
            yield Guess(signal, sure + preferred, {"topic": channel.name, "field": path}, channel.count, defined=sure == STANDARD)


def _of_table(channel: ChannelInfo) -> Iterator[Guess]:
    """Yield what the columns may be of one of the tables of a run: each by its name, or by the table's where it has none."""
    bare = channel.name.partition("[")[0]
    for info in channel.fields:
        if info.means is not None:
            yield _of_format(channel, info, *info.means)
            continue
        words = words_of(info.path)
        of_both = f"{info.path} {bare}" if set(words) <= NAMELESS or (len(words) == len("".join(words)) == 1) else ""
        name = of_both if of_both and (found := meaning_of(of_both)) is not None and found[1] > 1 else info.path
        column = ChannelInfo(name, info.kind, channel.count, channel.rate_hz, (replace(info, path=""),))
        for guess in of_column(column, info.path):
            if guess.signal not in (LATITUDE, LONGITUDE) and not _is_of_another_unit(name, guess.signal):
                item = {k: v for k, v in guess.item.items() if k != "column"}
                yield replace(guess, item={"topic": channel.name, "field": info.path, **item})


def _is_of_another_unit(name: str, signal: str) -> bool:
    """Whether a name states a unit in brackets in which the signal it seems to be cannot be."""
    return _IN_BRACKETS.search(name) is not None and unit_in_name(name, signal) is None and dimension_of(signal) is not None


def _of_plane(channel: ChannelInfo, path: str, *, commanded: bool) -> Iterator[Guess]:
    """Yield what a field of a pose in the plane is; of a commanded one the angle alone is a signal, the heading wanted."""
    if commanded and path != "theta":
        return
    sure = 5.0 + bool(_FRAMED & set(words_of(channel.name)))
    yield Guess("yaw_goal_rad" if commanded else _PLANAR[path], sure, {"topic": channel.name, "field": path}, channel.count)


def _of_format(channel: ChannelInfo, info: FieldInfo, signal: str, how: Mapping[str, Any]) -> Guess:
    return Guess(signal, 9.0, {"topic": channel.name, "field": info.path, **how}, channel.count, defined=True)


def _of_vector(channel: ChannelInfo, parent: str, last: str, *, commanded: bool) -> tuple[str | None, float]:
    """Return the signal of one part of a vector or quaternion by its name in the standard messages."""
    name = parent.rpartition(".")[2]
    if commanded:
        return None, 0.0
    if last == "w" and {f.path for f in channel.fields} >= {f"{parent}.{p}" if parent else p for p in "xyz"}:
        return ATTITUDE, STANDARD
    if last not in ("x", "y", "z"):
        return None, 0.0
    if name in _VECTORS:
        return _VECTORS[name]["xyz".index(last)], STANDARD
    if name == "vector" and _EULER & set(words_of(channel.name)):
        return ("roll_rad", "pitch_rad", "yaw_rad")["xyz".index(last)], 6.0
    return None, 0.0


def _is_nothing(channel: ChannelInfo, parent: str) -> bool:
    """Whether a quaternion is all zeros: the driver has no attitude."""
    return not any(f.first and f.first[0] for f in channel.fields if f.path.rpartition(".")[0] == parent)


def _of_scalar(channel: ChannelInfo, info: FieldInfo) -> Iterator[Guess]:
    item: dict[str, Any] = {"topic": channel.name, "field": info.path}
    if info.path == "fluid_pressure":
        yield Guess("depth_m", 6.0, {**item, "unit": "Pa"}, channel.count)
        return
    if info.path.startswith(("velocity[", "effort[")) or info.path.rpartition(".")[2] in ("x", "y", "z", "w"):
        return
    name = info.path if info.path not in ("data", "vector", "position[0]") else ""
    first = [float(v) for v in info.first if isinstance(v, (int, float))]
    seen = info.span or ((min(first), max(first)) if first else None)
    found = meaning_of(f"{channel.name} {name}".strip(), seen)
    if found is None or found[0] in (TIME, LATITUDE, LONGITUDE):
        return
    unit = unit_of_field(channel.name, info.path, found[0])
    unit = stated_unit(channel.unit, found[0]) if unit is None and channel.unit else unit
    if unit is not None:
        item["unit"] = unit
    if found[0] in ("yaw_rad", "yaw_goal_rad") and {"heading", "compass", "hdg"} & set(words_of(f"{channel.name} {info.path}")):
        item["frame"] = "NED/FRD"
    yield Guess(*found, item, channel.count)
