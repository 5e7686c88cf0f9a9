"""What one column or topic of a log may be, by its name, its type and the size of its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from fieldsid.logs.channels import ATTITUDE
from fieldsid.logs.mapping.canonical_names import TIME, canonical, stated_unit, unit_in_name
from fieldsid.logs.mapping.word_meaning import COMMANDED, LATITUDE, LONGITUDE, meaning_of, words_of
from fieldsid.logs.reader import DEFINED, ChannelInfo, FieldInfo

_VECTORS = {
    "angular_velocity": ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s"),
    "angular": ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s"),
    "linear": ("surge_m_s", "sway_m_s", "heave_m_s"),
    "position": ("x_m", "y_m", "depth_m"),
}
_EULER = {"rpy", "euler", "attitude", "orientation", "angles"}
_COUNTERS = {"seq", "sec", "nanosec", "secs", "nsecs"}
_PLANAR = {"theta": "yaw_rad", "angular_velocity": "yaw_rate_rad_s", "linear_velocity": "surge_m_s"}
"""Fields of a pose in the plane, which has an x, a y and one angle."""
NOTHING = 0.1
"""What a column that never changes is as sure as, beside one that does."""


@dataclass(frozen=True, slots=True)
class Guess:
    """A signal that a column or field may be, how sure that is, and how it is read."""

    signal: str
    sure: float
    item: dict[str, Any]
    count: int


def of_column(channel: ChannelInfo, place: str | int) -> Iterator[Guess]:
    """Yield what a column may be; one of words is no signal."""
    found = meaning_of(channel.name)
    if found is None or channel.count == 0 or channel.kind != "number" or found[0] == TIME:
        return
    signal, sure = found
    span = channel.fields[0].span
    if signal in (LATITUDE, LONGITUDE):
        if span is None or max(map(abs, span)) <= (90.0 if signal == LATITUDE else 360.0):
            yield Guess(signal, _weighed(sure, span), {"column": place}, channel.count)
        return
    said = canonical(channel.name)
    unit = said.unit if said is not None else unit_in_name(channel.name, signal)
    item: dict[str, Any] = {"column": place}
    if unit is None and channel.unit:
        unit = stated_unit(channel.unit, signal)
    if unit not in (None, "1"):
        item["unit"] = unit
    yield Guess(signal, _weighed(sure, span), item, channel.count)


def _weighed(sure: float, span: tuple[float, float] | None) -> float:
    return sure if span is None or span[0] < span[1] else NOTHING


def of_topic(channel: ChannelInfo) -> Iterator[Guess]:
    """Yield what the fields of a topic may be."""
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
        if planar and info.path in _PLANAR and not commanded:
            yield Guess(_PLANAR[info.path], 5.0, {"topic": channel.name, "field": info.path}, channel.count)
            continue
        signal, sure = _of_vector(channel, parent, last, commanded=commanded)
        if signal is None:
            yield from _of_scalar(channel, info)
        elif not (signal == ATTITUDE and _is_nothing(channel, parent)):
            path = parent if signal == ATTITUDE else info.path
            yield Guess(signal, sure + preferred, {"topic": channel.name, "field": path}, channel.count)


def _of_format(channel: ChannelInfo, info: FieldInfo, signal: str, how: Mapping[str, Any]) -> Guess:
    return Guess(signal, 9.0, {"topic": channel.name, "field": info.path, **how}, channel.count)


def _of_vector(channel: ChannelInfo, parent: str, last: str, *, commanded: bool) -> tuple[str | None, float]:
    """Return the signal of one part of a vector or quaternion by its name in the standard messages."""
    name = parent.rpartition(".")[2]
    if commanded:
        return None, 0.0
    if last == "w" and {f.path for f in channel.fields} >= {f"{parent}.{p}" if parent else p for p in "xyz"}:
        return ATTITUDE, 8.0
    if last not in ("x", "y", "z"):
        return None, 0.0
    if name in _VECTORS:
        return _VECTORS[name]["xyz".index(last)], 8.0
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
    found = meaning_of(f"{channel.name} {name}".strip())
    if found is None or found[0] in (TIME, LATITUDE, LONGITUDE):
        return
    unit = unit_in_name(info.path.rpartition(".")[2], found[0])
    unit = stated_unit(channel.unit, found[0]) if unit is None and channel.unit else unit
    if unit is not None:
        item["unit"] = unit
    if found[0] in ("yaw_rad", "yaw_goal_rad") and {"heading", "compass", "hdg"} & set(words_of(f"{channel.name} {info.path}")):
        item["frame"] = "NED/FRD"
    yield Guess(*found, item, channel.count)
