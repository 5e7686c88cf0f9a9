"""Canonical column names and their unit suffixes: `yaw_rate_deg_s` is `yaw_rate_rad_s` in deg/s."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from fieldsid.logs.channels import POSITION
from fieldsid.logs.convert.servo_counts import BY_UNIT, FINS
from fieldsid.logs.convert.units import SPELLINGS, dimension_of, find_unit
from fieldsid.logs.mapping.name_words import ALL_UNITS, unit_said
from fieldsid.logs.mapping.vocabulary import LATITUDE, LONGITUDE, TIME
from fieldsid.logs.run import LINES, SIGNALS

STEMS: Mapping[str, str] = MappingProxyType(
    {re.sub(r"_(rad|m|rpm)(_s)?$", "", s): s for s, unit in SIGNALS.items() if unit not in ("", "1")}
)
"""Names without a unit, and the signal each stands for."""

OF_CHANGES: Mapping[str, str] = MappingProxyType({"angle rate": "angle", "speed": "length"})
"""Dimensions whose names leave out that a unit is one by a second, and that unit's dimension: a rate in `deg`."""


OF_TOPIC = frozenset({"", "data", "value"})
"""Fields that say nothing of what they are."""


class Canonical(NamedTuple):
    """What a column name says: the canonical signal (or `time_s`) and the unit of its numbers."""

    signal: str
    unit: str


def canonical(column: str) -> Canonical | None:
    """Return the signal and unit that a column name states, or None when it is no canonical name."""
    name = column.strip().lower()
    if name in ("thrust", "thrust_ratio"):
        return Canonical(name, "1")
    if name in LINES:
        return Canonical(name, "rad")
    for at in (found.start() for found in re.finditer("_", name)):
        signal, spelled = {**STEMS, "time": TIME}.get(name[:at], ""), name[at + 1 :].replace("_", "/")
        units = [SPELLINGS[d][spelled] for d in fitting(signal) if spelled in SPELLINGS[d] and spelled in ALL_UNITS]
        if units:
            return Canonical(signal, units[0].name)
    return None


def fitting(signal: str) -> tuple[str, ...]:
    """Return the dimensions that a signal's numbers may have: a depth may be a pressure; none where any unit may be meant."""
    dimension = {TIME: "time", POSITION: "angle", LATITUDE: "angle", LONGITUDE: "angle"}.get(signal, dimension_of(signal))
    return (*((dimension,) if dimension else ()), *(("pressure",) if signal == "depth_m" else ()))


def stated_unit(text: str, signal: str) -> str | None:
    """Return a unit that stands beside a signal, as `deg/s` or `[deg/s]`, by its own name; None where it does not fit."""
    bare = text.strip().strip("[]()")
    units = (find_unit(bare, dimension) for dimension in fitting(signal))
    return next((u.name for u in units if u is not None and u.dimension in fitting(signal)), None)


def unit_in_name(name: str, signal: str, beside: str | None = None) -> str | None:
    """Return the unit a name, or what stands beside it, states for a signal: `heading [deg]`, `r (deg/s)`, `DepthFt`; else None.

    A rate named with the unit of its angle, or a speed with that of its way, is one by a second.
    """
    said, dimensions = canonical(name), fitting(signal)
    if said is not None and said.signal == signal and said.unit != "1":
        return said.unit
    found = unit_said(name, dimensions) or (unit_said(name, ("time", "ratio")) if signal in FINS else None)
    if found is not None and (found.dimension in dimensions or found.name in BY_UNIT):
        return "rad/s" if found.name == "rev/s" and signal != "propeller_rpm" else found.name
    whole = unit_said(name, (OF_CHANGES[dimensions[0]],)) if dimensions and dimensions[0] in OF_CHANGES else None
    by_second = None if whole is None else find_unit(f"{whole.name}/s")
    return by_second.name if by_second is not None else stated_unit(beside, signal) if beside else None


def unit_of_field(topic: str, field: str, signal: str, beside: str | None = None) -> str | None:
    """Return the unit that a field of a topic states by its name, or where that says nothing, as `data`, the topic's."""
    last = field.rpartition(".")[2]
    of_topic = unit_in_name(topic.rpartition("/")[2], signal) if last in OF_TOPIC else None
    return of_topic or unit_in_name(last, signal, beside)
