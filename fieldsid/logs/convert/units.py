"""Units of logs and their conversion to SI and radians, which is done once, at import.

A unit is a dimension and a factor: value in SI = factor x value. Column names may end in a unit
(`yaw_deg`, `yaw_rate_deg_s`, `surge_kn`), which is then converted without a mapping.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from fieldsid.errors import MappingError
from fieldsid.logs.run import COLUMNS, signal_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

DEGREE = math.pi / 180.0
GRAVITY = 9.80665
"""Standard acceleration of free fall in m/s^2."""


@dataclass(frozen=True, slots=True)
class Unit:
    """One unit: its name, its dimension, and the factor to the dimension's SI unit."""

    name: str
    dimension: str
    factor: float


UNIT_LIMIT = 0.15
"""Largest relative difference of a measured ratio from the factor of a unit at which the signal may still be in that unit."""
CLEARLY = 2.0
"""Factor by which the best candidate (a unit, a heading, a fin) must be better than the second best to be taken. On six zigzags
of ships it was 4.8 to 20."""

_SIMPLE: Mapping[str, Mapping[str, tuple[float, str]]] = {
    "angle": {
        "rad": (1.0, "radian radians rads"),
        "deg": (DEGREE, "degree degrees degs grad"),
        "mrad": (1e-3, "mrads milliradian milliradians millirad"),
        "rev": (2 * math.pi, "revs revolution revolutions"),
        "ddeg": (DEGREE / 10, "decideg decidegs decidegree decidegrees"),
        "cdeg": (DEGREE / 100, "cdegs cd centideg centidegs centidegree centidegrees"),
        "mdeg": (DEGREE / 1000, "mdegs millideg millidegs millidegree millidegrees"),
        "gon": (math.pi / 200, "gons gradian gradians"),
    },
    "length": {
        "m": (1.0, "meter meters metre metres mtr mtrs msw"),
        "cm": (1e-2, "cms centimeter centimeters centimetre centimetres"),
        "mm": (1e-3, "mms millimeter millimeters millimetre millimetres"),
        "km": (1e3, "kms kilometer kilometers kilometre kilometres"),
        "ft": (0.3048, "feet foot fsw"),
        "in": (0.0254, "inch inches"),
        "yd": (0.9144, "yds yard yards"),
        "fathom": (1.8288, "fathoms fath fth fthm fthms ftm"),
        "mi": (1609.344, "mile miles"),
        "nmi": (1852.0, "nm nauticalmile nauticalmiles"),
    },
    "pressure": {
        "Pa": (1.0, "pascal pascals"),
        "hPa": (1e2, "hectopascal hectopascals"),
        "kPa": (1e3, "kilopascal kilopascals"),
        "MPa": (1e6, "megapascal megapascals"),
        "mbar": (1e2, "millibar millibars mb"),
        "dbar": (1e4, "decibar decibars"),
        "bar": (1e5, "bars"),
        "psi": (6894.757293168, "psia"),
    },
    "time": {
        "s": (1.0, "sec secs second seconds"),
        "ms": (1e-3, "msec msecs millis millisec millisecs millisecond milliseconds"),
        "us": (1e-6, "usec usecs micros microsec microsecs microsecond microseconds"),
        "ns": (1e-9, "nsec nsecs nanos nanosec nanosecs nanosecond nanoseconds"),
        "min": (60.0, "mins minute minutes"),
        "h": (3600.0, "hr hrs hour hours"),
        "d": (86400.0, "day days datenum"),
    },
    "ratio": {"1": (1.0, "- ratio"), "%": (1e-2, "percent percentage pct perc")},
    "force": {"N": (1.0, "newton newtons"), "kN": (1e3, ""), "kgf": (GRAVITY, "")},
}
"""Units by dimension: the factor to SI, and other spellings."""
_QUOTIENTS: Mapping[str, Mapping[str, str]] = {
    "angle rate": {
        "rad/s": "", "deg/s": "dps", "mrad/s": "", "mdeg/s": "mdps", "cdeg/s": "", "deg/min": "dpm", "deg/h": "dph",
        "rev/s": "rps 1/s",
    },
    "speed": {
        "m/s": "", "cm/s": "", "mm/s": "", "km/h": "kph", "ft/s": "fps", "ft/min": "fpm", "m/min": "",
    },
}  # fmt: skip
"""Units divided by a unit of time; their spellings combine those of both, with `/`, `p`, `per` or nothing between."""
_NAMED: Mapping[str, Mapping[str, tuple[float, str]]] = {
    "angle rate": {"rpm": (math.pi / 30, "1/min rev/min revs/min rpms")},
    "speed": {"kn": (1852.0 / 3600.0, "kt kts kns knot knots nmi/h"), "mph": (1609.344 / 3600.0, "mi/h mile/h miles/h")},
}
_ORDER = ("angle", "angle rate", "speed", "length", "pressure", "time", "ratio", "force")


def _spelled() -> Iterator[tuple[Unit, set[str]]]:
    """Yield every unit with its spellings in the form of `folded`."""
    simple = {name: (*of, dimension) for dimension, units in _SIMPLE.items() for name, of in units.items()}
    for dimension in _ORDER:
        for name, (factor, others) in {**_SIMPLE.get(dimension, {}), **_NAMED.get(dimension, {})}.items():
            yield Unit(name, dimension, factor), {folded(name), *others.split()}
        for name, others in _QUOTIENTS.get(dimension, {}).items():
            above, below = (simple[part] for part in name.split("/"))
            over, under = ({part, *of[1].split()} for part, of in zip(name.split("/"), (above, below), strict=True))
            made = {f"{a}{by}{b}" for a in over for b in under for by in ("/", "", "p")}
            yield Unit(name, dimension, above[0] / below[0]), made | set(others.split())


_MARKS = (("°", "deg"), ("º", "deg"), ("µ", "u"), ("μ", "u"), ("⁻¹", "-1"))
_PER = re.compile(r"[\s_]*(?:/|\bper\b|_per_)[\s_]*")
_INVERSE = re.compile(r"[\s_.·*]+([a-z]+)\^?\(?-1\)?$")
_BLANK = re.compile(r"\^?-1$|[\s_.·*]")
_MULTIPLE = re.compile(r"(?P<number>\d*\.?\d+(?:[eE][+-]?\d+)?)\s*[*x·]?\s*(?P<unit>\D.*)")


def folded(text: str) -> str:
    """Return a unit's spelling in one common form of case, blanks, `per`, `^-1`, degree sign and micro."""
    plain = text.strip().lower()
    for mark, word in _MARKS:
        plain = plain.replace(mark, word)
    return _BLANK.sub("", _INVERSE.sub(r"/\1", _PER.sub("/", plain))) if len(plain) > 1 else plain


_ALL = tuple(_spelled())
UNITS: Mapping[str, Unit] = MappingProxyType({unit.name: unit for unit, _ in _ALL})
"""Every unit by its name; pick_unit also takes common spellings."""
SPELLINGS: Mapping[str, Mapping[str, Unit]] = MappingProxyType(
    {d: MappingProxyType({text: u for u, texts in _ALL if u.dimension == d for text in texts}) for d in _ORDER}
)
"""Units by dimension and folded spelling, because `ms` of a time means another unit than `ms` of a speed."""

_DIMENSION_OF = {"rad": "angle", "rad/s": "angle rate", "m": "length", "m/s": "speed", "1": "ratio", "1/min": "angle rate"}


def pick_unit(name: str, dimensions: Sequence[str] = (), what: str = "", others: str = "") -> Unit:
    """Return a unit by name or common spelling (`degrees`, `°/s`, `knots`), of the first dimension where several have it.

    Raises MappingError with the near matches, or with the units that fit where it has none of the dimensions; `what` is in the
    unit, and `others` is said after those that fit.
    """
    found = find_unit(name, next(iter(dimensions), None))
    known = [u.name for u in UNITS.values() if not dimensions or u.dimension == dimensions[0]]
    if found is None:
        raise MappingError(f"{what}{': ' * bool(what)}there is no unit {name!r}", found=", ".join(known), hint=near(name, known))
    if dimensions and found.dimension not in dimensions:
        hint = f"use a unit of {dimensions[0]}: {', '.join(f'`{u}`' for u in known)}{others}"
        raise MappingError(f"{what} cannot be in {name!r}", found=f"a unit of {found.dimension}", hint=hint)
    return found


def find_unit(name: str, dimension: str | None = None) -> Unit | None:
    """Return a unit by name or common spelling, or a multiple of one, such as `0.1 deg`; None where the text is no unit.

    Where several dimensions have the spelling, such as `ms`, the unit of `dimension` is returned.
    """
    plain, spelling = name.strip(), folded(name)
    if dimension is not None and spelling in SPELLINGS[dimension]:
        return SPELLINGS[dimension][spelling]
    found = UNITS.get(plain) or next((known[spelling] for known in SPELLINGS.values() if spelling in known), None)
    several = _MULTIPLE.fullmatch(plain) if found is None else None
    base = find_unit(several["unit"], dimension) if several else None
    return found if base is None or several is None else Unit(plain, base.dimension, float(several["number"]) * base.factor)


def unit_among(name: str, dimensions: Iterable[str]) -> Unit | None:
    """Return the unit that a text is in one of some dimensions, the first that has it; None where it is in none of them."""
    return next((u for d in dimensions if (u := find_unit(name, d)) is not None and u.dimension == d), None)


def dimension_of(signal: str) -> str | None:
    """Return the dimension of a canonical signal or of a term of its sum; None for `thrust`, which takes any unit, and others."""
    return _DIMENSION_OF.get(COLUMNS.get(signal_of(signal), ""))


def factor_to(signal: str, unit: str) -> float:
    """Return the factor from a unit to that of a canonical signal; raises MappingError where the dimensions differ.

    `thrust` takes any unit and has the factor 1. Pressure for `depth_m` is not a factor: see depth_of_pressure.
    """
    dimension = dimension_of(signal)
    if dimension is None:
        return 1.0
    picked = pick_unit(unit, (dimension,), f"`{signal}`")
    return picked.factor * 30.0 / math.pi if COLUMNS[signal] == "1/min" else picked.factor


def scaled(values: FloatArray, factor: float) -> FloatArray:
    """Return values times a factor; where that is one over a whole number, divided by it: 50 ms are 0.05 s to the last bit."""
    whole = float(np.rint(1.0 / factor)) if 0.0 < abs(factor) < 1.0 else 0.0
    return values if factor == 1.0 else values / whole if whole and 1.0 / whole == factor else values * factor


def depth_of_pressure(pressure_pa: FloatArray, *, density: float, surface_pa: float) -> FloatArray:
    """Return depth in m, positive down, of an absolute pressure (n,) in Pa: (p - p_surface) / (rho g)."""
    return np.asarray((pressure_pa - surface_pa) / (density * GRAVITY))


def unit_of_ratio(ratio: float, units: Mapping[str, float]) -> str | None:
    """Return the unit whose factor is near to the ratio of true to stated values, and clearly nearer than that of any other."""
    off = sorted((abs(ratio / factor - 1.0), name) for name, factor in units.items())
    return off[0][1] if off[0][0] < min(UNIT_LIMIT, off[1][0] / CLEARLY) else None
