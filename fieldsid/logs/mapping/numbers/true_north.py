"""Which way a table's heading and its x count, by columns that are known to point north and east.

Heading, x and y from north and clockwise, and all three from east and counterclockwise, are mirror images of each other: no
number of theirs tells which. A latitude and longitude does, a course over ground, and speeds north and east.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.geodetic import north_and_east
from fieldsid.logs.doctor.course_findings import AGREES, TURNED, WINDOW_S
from fieldsid.logs.mapping.canonical_names import unit_in_name
from fieldsid.logs.mapping.name_words import words_of
from fieldsid.logs.mapping.vocabulary import COMMANDED, LATITUDE, LONGITUDE, OF_ANOTHER, OVER_GROUND
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import Samples
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

NEAR = math.pi / 4
"""How far the angle between them may be from what it should be: sideslip, a current and a compass' error lie in it."""
FEWEST = 50
ENU = "ENU"
COMPASS = frozenset({"heading", "hdg", "compass", "true", "magnetic"})
"""Words of a heading that is one by its name: from north, clockwise."""
GEOGRAPHIC = frozenset({"north", "northing", "east", "easting", "n", "e", "utm"})
"""Words of a column of metres that say which way it counts."""
ComplexArray = npt.NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Travel:
    """The way a vehicle goes (n,), north and i times east, at each sample, and the columns that say so."""

    said_by: str
    way: ComplexArray


def true_north(samples: Samples, names: Sequence[str], signals: Mapping[str, Any]) -> list[Note]:
    """Set the frame of a heading, and of x and y, that count from east; return why, or that and how it stays open."""
    heading, position = _heading(samples, signals), _position(samples, signals)
    if heading is None and position is None:
        return []
    notes: list[Note] = []
    settled: set[str] = set()
    for travel in _travels(samples, names):
        for what, ways in (("x_m", position), ("yaw_rad", heading)):
            if ways is None or what in settled:
                continue
            along, against, off = _agreement(ways, travel.way)
            if max(along, against) < AGREES or abs(along - against) < TURNED or (against > along and abs(off) > NEAR):
                continue
            settled.add(what)
            if against > along:
                notes.append(_turned(what, signals, travel, against, along))
    if "yaw_rad" in settled or heading is None or position is None or _is_named(signals):
        return notes
    along, against, _ = _agreement(heading, position)
    return [*notes, _open()] if "x_m" not in settled and along > AGREES and along - against > TURNED else notes


def _turned(what: str, signals: Mapping[str, Any], travel: Travel, against: float, along: float) -> Note:
    turned = ("x_m", "y_m") if what == "x_m" else ("yaw_rad",)
    for signal in turned:
        signals[signal]["frame"] = ENU
    names = " and ".join(turned)
    message = (
        f"{names}: taken with `frame: {ENU}`, counted from east: the way by {travel.said_by} turns against it (agreement "
        f"{against:.2f} against and {along:.2f} along it, limit {TURNED:g} between them)"
    )
    return Note("evidence", message, {"signal": what, "value": against - along, "limit": TURNED})


def _open() -> Note:
    message = (
        "yaw_rad goes with x_m and y_m whether all three count from north, clockwise, or from east, counterclockwise: the log "
        "does not tell port from starboard; a latitude and longitude or a course over ground beside them would, and so does a "
        "turn whose side is known; where it is east set `frame: ENU/FLU` at the top of the mapping"
    )
    return Note("frame_open", message, {"signal": "yaw_rad"})


def _is_named(signals: Mapping[str, Any]) -> bool:
    """Whether the names of the columns say themselves which way they count."""
    words = {s: set(words_of(str(signals[s].get("column")))) for s in ("yaw_rad", "x_m", "y_m")}
    return bool(COMPASS & words["yaw_rad"] or GEOGRAPHIC & (words["x_m"] | words["y_m"])) or any(
        "frame" in signals[s] for s in words
    )


def _heading(samples: Samples, signals: Mapping[str, Any]) -> ComplexArray | None:
    item = signals.get("yaw_rad", {})
    values = samples.columns.get(item["column"]) if "column" in item else None
    if values is None or "frame" in item or "sign" in item:
        return None
    return np.asarray(np.exp(1j * _radians(values, item.get("unit"))))


def _position(samples: Samples, signals: Mapping[str, Any]) -> ComplexArray | None:
    """Return the way made (n,) by x and y, x real; None where they are not there or their frame is known."""
    items = [signals.get(s, {}) for s in ("x_m", "y_m")]
    x, y = (samples.columns.get(item["column"]) if "column" in item else None for item in items)
    if x is None or y is None or any("frame" in item or "sign" in item for item in items):
        return None
    return _made(samples, x, y)


def _travels(samples: Samples, names: Sequence[str]) -> Iterator[Travel]:
    """Yield the ways by columns that are north and east by what they are."""
    known = [n for n in names if n in samples.columns and not (COMMANDED | OF_ANOTHER) & set(words_of(n))]
    means = {n: (meaning_of(n) or ("", 0))[0] for n in known}
    latitude, longitude = (next((n for n in known if means[n] == s), None) for s in (LATITUDE, LONGITUDE))
    if latitude is not None and longitude is not None:
        north, east = north_and_east(np.stack([samples.columns[latitude], samples.columns[longitude]], axis=1))
        yield Travel(f"`{latitude}` and `{longitude}`", _made(samples, north, east))
    fast = [next((n for n in known if _is_speed(n, side)), None) for side in ("n", "e")]
    if fast[0] is not None and fast[1] is not None:
        yield Travel(f"`{fast[0]}` and `{fast[1]}`", samples.columns[fast[0]] + 1j * samples.columns[fast[1]])
    for name in known:
        values = samples.columns[name]
        if _is_course(name, means[name], values):
            yield Travel(f"the course over ground `{name}`", np.exp(1j * _radians(values, unit_in_name(name, "yaw_rad"))))


def _is_course(name: str, means: str, values: FloatArray) -> bool:
    """Whether a column is a course over ground, which counts from north: so it is called, or a course that is never negative."""
    words = set(words_of(name))
    if "cog" in words or (means == "yaw_rad" and OVER_GROUND & words):
        return True
    return "course" in words and float(np.nanmin(values, initial=np.inf)) >= 0.0


def _is_speed(name: str, side: str) -> bool:
    words = set(words_of(name))
    whole = {"n": "north", "e": "east"}[side]
    return f"v{side}" in words or (bool(words & {"v", "vel", "velocity", "speed"}) and bool(words & {side, whole, f"{whole}ing"}))


def _radians(values: FloatArray, unit: str | None) -> FloatArray:
    """Return an angle (n,) in rad: by its unit, without one by its size."""
    seen = np.abs(values[np.isfinite(values)])
    is_deg = unit == "deg" or (unit is None and bool(seen.size) and float(seen.max()) > math.tau + 0.1)
    return np.radians(values) if is_deg else values


def _made(samples: Samples, north: FloatArray, east: FloatArray) -> ComplexArray:
    """Return the way made (n,) over a window about each sample, NaN at the ends."""
    step = float(np.nanmedian(np.diff(samples.time))) if samples.time.size > 1 else math.nan
    half = max(1, round(0.5 * WINDOW_S / step)) if step > 0.0 else 1
    way = np.full(north.size, np.nan, dtype=np.complex128)
    place = north + 1j * east
    if place.size > 2 * half:
        way[half:-half] = place[2 * half :] - place[: -2 * half]
    return way


def _agreement(ways: ComplexArray, travel: ComplexArray) -> tuple[float, float, float]:
    """Return how well a direction (n,) goes with the travel and with its mirror image, and the angle off the latter in rad.

    From east and counterclockwise x + iy is i (north - i east): what goes with the mirror image is pi/2 from it.
    """
    weight = np.abs(travel) * np.abs(ways)
    seen = np.isfinite(weight) & (weight > 0.0)
    if seen.sum() < FEWEST:
        return 0.0, 0.0, 0.0
    a, b, w = ways[seen] / np.abs(ways[seen]), travel[seen] / np.abs(travel[seen]), weight[seen]
    along, against = complex(np.average(a * np.conj(b), weights=w)), complex(np.average(a * b, weights=w))
    return abs(along), abs(against), math.remainder(float(np.angle(against)) - 0.5 * math.pi, math.tau)
