"""Units of logs and their conversion to SI and radians, once, at import.

A unit is a dimension and a factor: value in SI = factor x value. Column names may end in a unit
(`yaw_deg`, `yaw_rate_deg_s`, `surge_kn`), which is then converted without a mapping.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from fieldsid.errors import MappingError
from fieldsid.logs.run import COLUMNS, signal_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

DEGREE = math.pi / 180.0
KNOT = 1852.0 / 3600.0


@dataclass(frozen=True, slots=True)
class Unit:
    """One unit: its name, its dimension, and the factor to the dimension's SI unit."""

    name: str
    dimension: str
    factor: float


_BY_DIMENSION: dict[str, dict[str, float]] = {
    "angle": {
        "rad": 1.0,
        "deg": DEGREE,
        "mrad": 1e-3,
        "rev": 2 * math.pi,
        "ddeg": DEGREE / 10,
        "cdeg": DEGREE / 100,
        "gon": math.pi / 200,
    },
    "angle rate": {
        "rad/s": 1.0,
        "deg/s": DEGREE,
        "mrad/s": 1e-3,
        "deg/min": DEGREE / 60,
        "rev/s": 2 * math.pi,
        "rpm": math.pi / 30,
    },
    "speed": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "km/h": 1 / 3.6, "kn": KNOT, "ft/s": 0.3048},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3, "ft": 0.3048, "nmi": 1852.0},
    "pressure": {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "mbar": 1e2, "dbar": 1e4, "bar": 1e5, "psi": 6894.757293168},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86400.0},
    "ratio": {"1": 1.0, "%": 1e-2},
    "force": {"N": 1.0, "kN": 1e3, "kgf": 9.80665},
}

_ALIASES = {
    "radian": "rad", "radians": "rad", "degree": "deg", "degrees": "deg", "grad": "deg", "°": "deg", "rads": "rad/s",
    "rps": "rev/s", "°/s": "deg/s", "dps": "deg/s", "deg/sec": "deg/s", "rad/sec": "rad/s", "1/min": "rpm", "rev/min": "rpm",
    "1/s": "rev/s",
    "mps": "m/s", "m/sec": "m/s", "knot": "kn", "knots": "kn", "kt": "kn", "kts": "kn", "kmh": "km/h", "kph": "km/h",
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "feet": "ft", "pascal": "Pa", "millibar": "mbar",
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "usec": "us", "µs": "us", "μs": "us", "nsec": "ns",
    "minute": "min", "minutes": "min", "day": "d", "days": "d", "datenum": "d",
    "percent": "%", "-": "1", "ratio": "1", "newton": "N",
}  # fmt: skip

UNITS: Mapping[str, Unit] = MappingProxyType(
    {name: Unit(name, dimension, factor) for dimension, names in _BY_DIMENSION.items() for name, factor in names.items()}
)
"""Every unit by its name; pick_unit also takes common spellings."""

_DIMENSION_OF = {"rad": "angle", "rad/s": "angle rate", "m": "length", "m/s": "speed", "1": "ratio", "1/min": "angle rate"}


def pick_unit(name: str) -> Unit:
    """Return a unit by name or common spelling (`degrees`, `°/s`, `knots`); raises MappingError with the near matches."""
    found = find_unit(name)
    if found is None:
        raise MappingError(f"there is no unit {name!r}", found=", ".join(UNITS), hint=near(name, UNITS))
    return found


def find_unit(name: str) -> Unit | None:
    """Return a unit by name or common spelling, or None."""
    plain = name.strip().replace(" ", "").replace("^-1", "").replace("·", "")
    for candidate in (plain, _ALIASES.get(plain, ""), _ALIASES.get(plain.lower(), ""), plain.lower()):
        if candidate in UNITS:
            return UNITS[candidate]
    folded = {u.lower(): u for u in UNITS}
    return UNITS[folded[plain.lower()]] if plain.lower() in folded else None


def dimension_of(signal: str) -> str | None:
    """Return the dimension of a canonical signal, or an entry of its sum; None for `thrust`, which may be in any unit."""
    return _DIMENSION_OF.get(COLUMNS[signal_of(signal)])


def factor_to(signal: str, unit: str) -> float:
    """Return the factor from a unit to a canonical signal's own; raises MappingError where the unit cannot be meant.

    `thrust` takes any unit and is left as it is. Pressure for `depth_m` is not a factor: see depth_of_pressure.
    """
    dimension = dimension_of(signal)
    if dimension is None:
        return 1.0
    picked = pick_unit(unit)
    if picked.dimension != dimension:
        fitting = [u.name for u in UNITS.values() if u.dimension == dimension]
        raise MappingError(
            f"`{signal}` cannot be in {picked.name!r}",
            found=f"{picked.name} is a unit of {picked.dimension}",
            hint=f"use one of: {', '.join(fitting)}",
        )
    return picked.factor * 30.0 / math.pi if COLUMNS[signal] == "1/min" else picked.factor


def scaled(values: FloatArray, factor: float) -> FloatArray:
    """Return values times a factor; a factor of one changes nothing, not even the last bit."""
    return values if factor == 1.0 else values * factor


def depth_of_pressure(pressure_pa: FloatArray, *, density: float, surface_pa: float, gravity: float = 9.80665) -> FloatArray:
    """Return depth in m, positive down, of an absolute pressure (n,) in Pa: (p - p_surface) / (rho g)."""
    return np.asarray((pressure_pa - surface_pa) / (density * gravity))
