"""A first mapping for a log nobody has mapped yet, from names, message types and the size of the numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.logs.channels import ATTITUDE, ChannelMap
from fieldsid.logs.clocktime import likely_time_unit
from fieldsid.logs.names import TIME, canonical, unit_in_name
from fieldsid.logs.reader import ChannelInfo, FieldInfo, Inventory, Reader, ReadOptions
from fieldsid.logs.run import SIGNALS, Run
from fieldsid.logs.words import COMMANDED, meaning_of, words_of

REP103 = "ENU/FLU"
_VECTORS = {
    "angular_velocity": ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s"),
    "angular": ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s"),
    "linear": ("surge_m_s", "sway_m_s", "heave_m_s"),
    "position": ("x_m", "y_m", "depth_m"),
}
_EULER = {"rpy", "euler", "attitude", "orientation", "angles"}
_COUNTERS = {"seq", "sec", "nanosec", "secs", "nsecs"}
_DEGREES = {"yaw_rad": 6.4, "pitch_rad": 1.6, "roll_rad": 3.3, "yaw_rate_rad_s": 4.0, "pitch_rate_rad_s": 4.0,
            "roll_rate_rad_s": 8.0,
            "rudder_rad": 1.6, "elevator_rad": 1.6, "rudder_measured_rad": 1.6, "elevator_measured_rad": 1.6}  # fmt: skip
"""Angles and rates larger than this are taken for degrees."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """A mapping's body, the Run it gives, or why it gives none."""

    body: dict[str, Any]
    run: Run | None = None
    problem: FieldsidError | None = None


@dataclass(frozen=True, slots=True)
class _Guess:
    signal: str
    sure: float
    item: dict[str, Any]
    count: int


def propose(inventory: Inventory, reader: Reader, options: ReadOptions) -> Proposal:
    """Return a mapping that `load_mapping` takes as soon as it names a signal, tried on the log itself."""
    body = _body(inventory)
    if not body["signals"]:
        return Proposal(body)
    try:
        return _tried(inventory, reader, options, body)
    except FieldsidError as error:
        return Proposal(body, problem=error)


def _body(inventory: Inventory) -> dict[str, Any]:
    is_bag = inventory.form.endswith("bag")
    best: dict[str, _Guess] = {}
    for guess in (g for c in inventory.channels for g in (_of_topic(c) if is_bag else _of_column(c))):
        known = best.get(guess.signal)
        if known is None or (guess.sure, guess.count) > (known.sure, known.count):
            best[guess.signal] = guess
    if ATTITUDE in best:
        for angle in ("yaw_rad", "pitch_rad", "roll_rad"):
            best.pop(angle, None)
    time = best.pop(TIME, None)
    body: dict[str, Any] = {"schema": "fieldsid/mapping/1"}
    if is_bag:
        named = " ".join(c.name + c.kind for c in inventory.channels).lower()
        body["frame"] = "NED/FRD" if "ned" in words_of(named) else REP103
    elif time is not None:
        body["time"] = time.item
    elif inventory.table is not None and not inventory.table.header:
        body["time"] = {"column": 0, "unit": "s"}
    body["signals"] = {signal: best[signal].item for signal in (ATTITUDE, *SIGNALS) if signal in best}
    return body


def _of_column(channel: ChannelInfo) -> Iterator[_Guess]:
    found = meaning_of(channel.name)
    if found is None or channel.count == 0 or (channel.kind != "number" and found[0] != TIME):
        return
    signal, sure = found
    item: dict[str, Any] = {"column": channel.name}
    said = canonical(channel.name)
    unit = said.unit if said is not None else unit_in_name(channel.name, signal)
    if signal == TIME:
        unit = unit or likely_time_unit(np.asarray(channel.fields[0].first[:1]))
    if unit not in (None, "1"):
        item["unit"] = unit
    yield _Guess(signal, sure, item, channel.count)


def _of_topic(channel: ChannelInfo) -> Iterator[_Guess]:
    commanded = bool(COMMANDED & set(words_of(channel.name)))
    preferred = 1.0 if channel.kind.endswith("Imu") else 0.0
    for info in channel.fields:
        parent, _, last = info.path.rpartition(".")
        if last in _COUNTERS or "covariance" in info.path or "[" in parent:
            continue
        signal, sure = _of_vector(channel, parent, last, commanded=commanded)
        if signal is None:
            yield from _of_scalar(channel, info)
        elif not (signal == ATTITUDE and _is_nothing(channel, parent)):
            path = parent if signal == ATTITUDE else info.path
            yield _Guess(signal, sure + preferred, {"topic": channel.name, "field": path}, channel.count)


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


def _of_scalar(channel: ChannelInfo, info: FieldInfo) -> Iterator[_Guess]:
    item: dict[str, Any] = {"topic": channel.name, "field": info.path}
    if info.path == "fluid_pressure":
        yield _Guess("depth_m", 6.0, {**item, "unit": "Pa"}, channel.count)
        return
    if info.path.startswith(("velocity[", "effort[")) or info.path.rpartition(".")[2] in ("x", "y", "z", "w"):
        return
    name = info.path if info.path not in ("data", "vector", "position[0]") else ""
    found = meaning_of(f"{channel.name} {name}")
    if found is None or found[0] == TIME:
        return
    unit = unit_in_name(info.path.rpartition(".")[2], found[0])
    if unit is not None:
        item["unit"] = unit
    if found[0] == "yaw_rad" and {"heading", "compass", "hdg"} & set(words_of(f"{channel.name} {info.path}")):
        item["frame"] = "NED/FRD"
    yield _Guess(*found, item, channel.count)


def _tried(inventory: Inventory, reader: Reader, options: ReadOptions, body: dict[str, Any]) -> Proposal:
    """Read the log with the proposal, and set degrees where the numbers say so."""
    from fieldsid.logs.assemble import assemble
    from fieldsid.logs.doctor import examine
    from fieldsid.logs.mapping import mapping_of
    from fieldsid.logs.stated import stated_by

    lenient = ReadOptions(options.msg_path, salvage=True)
    raw = reader.read(inventory.path, mapping_of(body), lenient)
    for signal, series in raw.series.items():
        item = body["signals"].get(signal, {})
        size = float(abs(series.values[series.values == series.values]).max(initial=0.0))
        if (
            signal in _DEGREES
            and series.values.ndim == 1
            and "unit" not in item
            and series.unit is None
            and size > _DEGREES[signal]
        ):
            item["unit"] = "deg/s" if signal.endswith("_s") else "deg"
    for _ in range(2):
        mapping: ChannelMap = mapping_of(body)
        run = assemble(raw, mapping, inventory.path, lenient, max_gap_s=float("inf"))
        notes = examine(run, stated=stated_by(mapping, raw))
        likely = {n.data["signal"]: n.data["unit"] for n in notes if n.code == "unit" and "unit" in n.data}
        wrong = [signal for signal in likely if "unit" not in body["signals"].get(signal, {"unit": 0})]
        if not wrong:
            break
        for signal in wrong:
            body["signals"][signal]["unit"] = likely[signal]
    return Proposal(body, Run(run.name, run.time, run.signals, inventory.path, (*run.notes, *notes)))
