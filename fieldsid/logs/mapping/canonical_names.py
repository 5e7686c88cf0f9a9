"""Canonical column names and their unit suffixes: `yaw_rate_deg_s` is `yaw_rate_rad_s` in deg/s."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from fieldsid.logs.convert.units import UNITS, dimension_of, find_unit
from fieldsid.logs.run import LINES, SIGNALS

TIME = "time_s"
_BRACKET = re.compile(r"[\[(](?P<unit>[^\])]+)[\])]")

STEMS: Mapping[str, str] = MappingProxyType(
    {
        "yaw": "yaw_rad", "yaw_rate": "yaw_rate_rad_s", "pitch": "pitch_rad", "pitch_rate": "pitch_rate_rad_s",
        "roll": "roll_rad", "roll_rate": "roll_rate_rad_s", "depth": "depth_m", "surge": "surge_m_s", "sway": "sway_m_s",
        "heave": "heave_m_s", "x": "x_m", "y": "y_m", "rudder": "rudder_rad", "elevator": "elevator_rad",
        "rudder_measured": "rudder_measured_rad", "elevator_measured": "elevator_measured_rad", "propeller": "propeller_rpm",
        "yaw_goal": "yaw_goal_rad", "pitch_goal": "pitch_goal_rad",
    }
)  # fmt: skip
"""Names without a unit, and the signal each stands for."""

_SUFFIX = {
    "rad": "rad", "deg": "deg", "mrad": "mrad", "rad_s": "rad/s", "deg_s": "deg/s", "mrad_s": "mrad/s", "m_s": "m/s",
    "cm_s": "cm/s", "mm_s": "mm/s", "km_h": "km/h", "kn": "kn", "ft_s": "ft/s", "m": "m", "cm": "cm", "mm": "mm",
    "km": "km", "ft": "ft", "rpm": "rpm", "rps": "rev/s", "s": "s", "ms": "ms", "us": "us", "ns": "ns", "min": "min",
    "h": "h", "dbar": "dbar", "bar": "bar", "mbar": "mbar", "pa": "Pa", "hpa": "hPa", "kpa": "kPa", "psi": "psi",
}  # fmt: skip


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
    for stem, suffix in _splits(name):
        unit = _SUFFIX.get(suffix)
        if unit is None:
            continue
        if stem == "time" and UNITS[unit].dimension == "time":
            return Canonical(TIME, unit)
        if stem in STEMS and _fits(STEMS[stem], unit):
            return Canonical(STEMS[stem], unit)
    return None


def canonical_names() -> tuple[str, ...]:
    """Return the names that are read with no mapping, time first."""
    return (TIME, *SIGNALS)


def _splits(name: str) -> list[tuple[str, str]]:
    parts = name.split("_")
    return [("_".join(parts[:i]), "_".join(parts[i:])) for i in range(1, len(parts))]


def _fits(signal: str, unit: str) -> bool:
    dimension = UNITS[unit].dimension
    return dimension == dimension_of(signal) or (signal == "depth_m" and dimension == "pressure")


def stated_unit(text: str, signal: str) -> str | None:
    """Return a unit that stands beside a signal, as `deg/s` or `[deg/s]`, by its own name; None where it does not fit."""
    unit = find_unit(text.strip().strip("[]()"))
    fits = unit is not None and (unit.dimension == "time" if signal == TIME else _fits(signal, unit.name))
    return unit.name if unit is not None and fits else None


def unit_in_name(name: str, signal: str) -> str | None:
    """Return the unit a name states for a signal: `heading [deg]`, `r (deg/s)`, `fin_deg`; None when it states none that fits."""
    inside = _BRACKET.search(name)
    if inside is not None:
        unit = find_unit(inside["unit"])
        return unit.name if unit is not None and (signal == TIME or _fits(signal, unit.name)) else None
    last = name.strip().rpartition(" ")[2] if " " in name.strip() else ""
    if len(last) > 1 and (found := stated_unit(last, signal)) is not None:
        return found
    for _, suffix in _splits(name.strip().lower()):
        unit_name = _SUFFIX.get(suffix)
        if unit_name is not None and (UNITS[unit_name].dimension == "time" if signal == TIME else _fits(signal, unit_name)):
            return unit_name
    return None
