"""Signals known by their numbers, where no name says what a column is: each by what physics ties it to the others.

A heading points the way made: the course of two columns of metres. A rate is the derivative of its angle. A speed is the way
made in a second. A fin is what the turning that neither rate nor speed explains follows: r' = a r + b delta. Each is believed
only where it stands out, and comes with the number that says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.geodetic import north_and_east
from fieldsid.logs.convert.servo_counts import COUNTS, servo_of
from fieldsid.logs.convert.units import KNOT
from fieldsid.logs.mapping.fins.shares import beyond
from fieldsid.logs.mapping.vocabulary import LATITUDE, LONGITUDE
from fieldsid.logs.reader import Samples
from fieldsid.numerics.arrays import FloatArray

WINDOWS_S = (1.0, 2.0, 10.0)
"""Times over which changes are taken: a fin shows best in a short one, a position with few digits its way in a long one."""
SAME_WAY = 0.9
"""Share of the way that is made along the heading: sideslip keeps it from one."""
TURNS_ALONG = 0.6
"""Correlation of heading and course from which on one turns with the other."""
MOST_SLIP = 3.0
"""How many times as far a heading may turn as its course, or the course as the heading: sideslip lies between them."""
MOST_WAYS = 30
BEYOND_TILTS_DEG = 90.0
FOLLOWS = 0.95
"""Correlation from which on one column is the derivative of another."""
EXPLAINS = 0.3
"""Share of a rate's change beside the rate's own that a fin must explain."""
CLEARLY = 2.0
"""How many times as much as any other column a fin must explain that the others do not: 4.8 to 18 on five ships' zigzags."""
UNITS = {"deg": math.pi / 180.0, "rad": 1.0}
GLOBE = (90.0, 180.0)
"""Largest latitude and longitude in degrees."""
AT_REST = 1e-3
"""A way of less than this in a second is no vehicle's in m, and every vehicle's in degrees of latitude and longitude."""
WITHIN = 0.1
"""Share of the speed by which the way made along the heading may differ from it."""
SPEEDS = {"m/s": 1.0, "kn": KNOT}
MOST_COLUMNS, FEWEST = 40, 50
RATES = {"yaw_rad": "yaw_rate_rad_s", "pitch_rad": "pitch_rate_rad_s", "roll_rad": "roll_rate_rad_s"}
PLACES = ("x_m", "y_m", LATITUDE, LONGITUDE)
Column = str | int
ComplexArray = npt.NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Recognised:
    """A signal, the column that it is, how it is to be read, why, and the correlation behind it."""

    signal: str
    column: Column
    item: Mapping[str, Any]
    why: str
    trust: float = 0.0


@dataclass(frozen=True, slots=True)
class _Scene:
    """Columns over windows of `width` samples: by signal those that are known, those that are free, and what was found so far."""

    samples: Samples
    width: int
    known: Mapping[str, Column]
    free: list[Column]
    found: tuple[Recognised, ...] = ()

    def knowing(self, found: Iterable[Recognised]) -> _Scene:
        more = tuple(found)
        taken = {r.column for r in more}
        known = {**self.known, **{r.signal: r.column for r in more}}
        return replace(self, known=known, free=[c for c in self.free if c not in taken], found=self.found + more)

    def changes(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the change of a column (n,) over the window."""
        return np.asarray(values[self.width :] - values[: -self.width])

    def is_geographic(self, x: Column, y: Column) -> bool:
        """Whether two columns are a latitude and a longitude in degrees: on the globe, and as slow as no way in m is."""
        columns = (self.samples.columns[x], self.samples.columns[y])
        if any(float(np.nanmax(np.abs(c))) > limit for c, limit in zip(columns, GLOBE, strict=True)):
            return False
        way, passed = np.hypot(*(self.changes(c) for c in columns)), self.passed
        good = np.isfinite(way) & (passed > 0.0)
        return bool(good.any()) and 0.0 < float(np.median(way[good] / passed[good])) < AT_REST

    def way(self, x: Column, y: Column) -> ComplexArray:
        """Return the way in m (n,) over the window by two columns, x real: metres, or degrees of latitude and longitude."""
        places = self.samples.columns[x], self.samples.columns[y]
        x_m, y_m = north_and_east(np.stack(places, axis=1)) if self.is_geographic(x, y) else places
        return np.asarray(self.changes(x_m + 1j * y_m))

    def middle(self, values: FloatArray) -> FloatArray:
        """Return a column (n,) in the middle of each window."""
        return values[self.width // 2 :][: values.size - self.width]

    @property
    def passed(self) -> FloatArray:
        """The time that passes over the window."""
        return self.changes(self.samples.time)

    def swept(self, column: Column) -> FloatArray:
        """Return the integral of a column over the window."""
        time = self.samples.time
        return self.changes(
            np.cumsum(np.nan_to_num(self.samples.columns[column]) * np.diff(np.nan_to_num(time), prepend=time[0]))
        )

    def angle(self, signal: str) -> FloatArray:
        """Return an angle that is known (n,) in rad, unwrapped."""
        return _radians(self.samples.columns[self.known[signal]], next((r.item for r in self.found if r.signal == signal), None))


def recognised(samples: Samples, known: Mapping[str, Column], free: list[Column]) -> tuple[Recognised, ...]:
    """Return signals among the columns that nobody named (`free`), beside those that are known by name.

    Of what several ways and windows would give, that in which the most columns find their place among the others is taken, and
    of those the one in which the rate is the heading's derivative best: that is exact, while a course is off by the sideslip.
    """
    best: tuple[Recognised, ...] = ()
    moving = [c for c in free if _moves(samples.columns[c])] if len(free) <= MOST_COLUMNS else []
    for scene in _scenes(samples, known, moving):
        for way in _ways(scene):
            seen = scene.knowing(way)
            for step in (_rates, _speeds, _fin):
                seen = seen.knowing(step(seen))
            best = max(best, seen.found, key=_worth)
    return best


def unit_of_heading(samples: Samples, heading: Column, position: tuple[Column, Column]) -> str | None:
    """Return the unit in which a heading points along the way made; None where it does so in none."""
    scene = next(_scenes(samples, {}, []), None)
    found = [] if scene is None else max(_pointing(scene, heading, position), key=lambda way: way[0].trust, default=[])
    return str(found[0].item["unit"]) if found else None


def _scenes(samples: Samples, known: Mapping[str, Column], free: list[Column]) -> Iterator[_Scene]:
    steps = np.diff(samples.time[np.isfinite(samples.time)])
    for window in WINDOWS_S if steps.size >= FEWEST else ():
        yield _Scene(samples, max(1, round(window / float(np.median(steps)))), known, free)


def _worth(found: tuple[Recognised, ...]) -> tuple[int, float]:
    return len(found), round(max((r.trust for r in found if r.signal not in PLACES), default=0.0), ndigits=3)


def _moves(values: FloatArray) -> bool:
    return bool(np.isfinite(values).mean() > 0.5) and float(np.nanmax(values) - np.nanmin(values)) > 0.0


def _radians(values: FloatArray, item: Mapping[str, Any] | None = None) -> FloatArray:
    """Return an angle (n,) in rad, unwrapped: by its unit, where nothing is found of it by its size."""
    largest = float(np.nanmax(np.abs(values)))
    unit = item.get("unit", "rad") if item is not None else "deg" if largest > math.tau + 0.1 else "rad"
    return np.unwrap(np.where(np.isfinite(values), UNITS[unit] * values, 0.0))


def _alike(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Return the correlation of two columns (n,), and the slope of the first on the second."""
    good = np.isfinite(a) & np.isfinite(b)
    if good.sum() < FEWEST or float(np.ptp(a[good])) == 0.0 or float(np.ptp(b[good])) == 0.0:
        return 0.0, 0.0
    trust = float(np.corrcoef(a[good], b[good])[0, 1])
    return trust, math.copysign(float(np.std(a[good]) / np.std(b[good])), trust)


def _ways(scene: _Scene) -> list[list[Recognised]]:
    """Return what heading, x and y may be, the likeliest first: triples in which the heading points the way made.

    Where none does, headings that go beyond what tilts do, and have a derivative; or nothing.
    """
    if "yaw_rad" in scene.known or "x_m" in scene.known:
        return [[]]
    angles = _with_rates(scene)
    found = [
        way
        for place in permutations(scene.free, 2)
        for heading in angles or scene.free
        if heading not in place
        for way in _pointing(scene, heading, place)
    ]
    turning = [
        [Recognised("yaw_rad", c, {"unit": "deg"}, f"it goes to {largest:.4g}, beyond tilts, and {why}", trust)]
        for c, (trust, why) in angles.items()
        if (largest := float(np.nanmax(np.abs(scene.samples.columns[c])))) > BEYOND_TILTS_DEG and trust > 0.0
    ]
    return sorted(found, key=lambda way: -way[0].trust)[:MOST_WAYS] or turning or [[]]


def _with_rates(scene: _Scene) -> dict[Column, tuple[float, str]]:
    """Return the columns of which another is the derivative, with the correlation, and that in words."""
    swept = {c: scene.swept(c) for c in scene.free}
    found: dict[Column, tuple[float, str]] = {}
    for angle in scene.free:
        turned = scene.changes(_radians(scene.samples.columns[angle]))
        pairs = [(*_alike(turned, swept[c]), c) for c in scene.free if c != angle]
        trust, slope, rate = max(pairs, key=lambda p: abs(p[0]), default=(0.0, 0.0, ""))
        if abs(trust) > FOLLOWS and any(abs(abs(slope) / f - 1.0) < 0.2 for f in (1.0, UNITS["deg"], 1.0 / UNITS["deg"])):
            found[angle] = trust, f"column {rate} is its derivative, correlation {trust:.3f}"
    return found


def _pointing(scene: _Scene, heading: Column, place: tuple[Column, Column]) -> Iterator[list[Recognised]]:
    """Yield what a heading, x and y are, where the way that two columns make is made along the one taken as a heading."""
    x, y = place
    way = scene.way(x, y)
    seen = np.isfinite(way)
    made = float(np.abs(way[seen]).sum())
    if not made > 0.0 or not float(np.median(np.abs(way[seen]))) > 0.0:
        return
    signals = (LATITUDE, LONGITUDE) if scene.is_geographic(x, y) else ("x_m", "y_m")
    course, values = np.unwrap(np.angle(way[seen])), scene.middle(np.nan_to_num(scene.samples.columns[heading]))[seen]
    for unit, factor in UNITS.items():
        along = float((way[seen] * np.exp(-1j * factor * values)).real.sum()) / made
        trust, slope = _alike(np.unwrap(factor * values), course)
        if along > SAME_WAY and trust > TURNS_ALONG and 1.0 / MOST_SLIP < slope < MOST_SLIP:
            why = f"{100 * along:.1f} % of the way that columns {x} and {y} make is made along it, correlation {trust:.3f}"
            same = f"the way made in it is along the heading in column {heading}"
            yield [Recognised("yaw_rad", heading, {"unit": unit}, why, trust),
                   *(Recognised(s, c, {}, same) for s, c in zip(signals, place, strict=True))]  # fmt: skip


def _rates(scene: _Scene) -> Iterator[Recognised]:
    """Yield the rates of the angles that are known: the columns whose sums over the window are the angle's change."""
    free = list(scene.free)
    for angle, rate in RATES.items():
        if angle not in scene.known or rate in scene.known or not free:
            continue
        turned = scene.changes(scene.angle(angle))
        trust, slope, column = max(((*_alike(turned, scene.swept(c)), c) for c in free), key=lambda found: abs(found[0]))
        unit = next((u for u, factor in UNITS.items() if 0.7 < abs(slope) / factor < 1.4), None)
        if unit is not None and abs(trust) >= FOLLOWS:
            free.remove(column)
            item = {"unit": f"{unit}/s"} | ({"sign": -1} if trust < 0.0 else {})
            why = f"it is the derivative of column {scene.known[angle]}, correlation {trust:.3f}"
            yield Recognised(rate, column, item, why, abs(trust))


def _speeds(scene: _Scene) -> Iterator[Recognised]:
    """Yield surge and sway: the columns that are the way made in a second along the heading and across it."""
    place = [scene.known[s] for s in PLACES if s in scene.known]
    if "surge_m_s" in scene.known or len(place) != 2 or "yaw_rad" not in scene.known:
        return
    made = scene.way(*place) * np.exp(-1j * scene.middle(scene.angle("yaw_rad"))) / scene.passed
    middle = {c: scene.middle(scene.samples.columns[c]) for c in scene.free}
    along = float(np.nanmedian(np.abs(made)))
    ahead = [(float(np.nanmedian(np.abs(f * v - made.real))) / along, c, u) for c, v in middle.items() for u, f in SPEEDS.items()]
    off, surge, unit = min(ahead, key=lambda found: found[0], default=(math.inf, "", ""))
    if not off < WITHIN:
        return
    yield Recognised("surge_m_s", surge, {"unit": unit}, f"it is the way made along the heading within {100 * off:.1f} %")
    across = [(*_alike(SPEEDS[unit] * v, made.imag), c) for c, v in middle.items() if c != surge]
    trust, slope, sway = max(across, key=lambda found: found[0], default=(0.0, 0.0, ""))
    if trust > FOLLOWS and 0.8 < slope < 1.25:
        yield Recognised("sway_m_s", sway, {"unit": unit}, f"it is the way made across the heading, correlation {trust:.3f}")


def _fin(scene: _Scene) -> Iterator[Recognised]:
    """Yield the rudder: of the columns about zero that which the change of the yaw rate follows beside the rate itself."""
    known, columns = scene.known, scene.samples.columns
    if {"rudder_rad", "rudder_measured_rad"} & known.keys() or not {"yaw_rad", "yaw_rate_rad_s"} & known.keys():
        return
    time = np.nan_to_num(scene.samples.time) + 1e-9 * np.arange(scene.samples.time.size)
    has_rate = "yaw_rate_rad_s" in known
    rate = np.nan_to_num(columns[known["yaw_rate_rad_s"]]) if has_rate else np.gradient(scene.angle("yaw_rad"), time)
    grows = scene.changes(rate) / scene.passed
    beside = [np.ones(grows.size), scene.middle(rate)]
    fins = {c: fin for c in scene.free if (fin := _deflected(columns[c])) is not None}
    means = {c: scene.changes(np.cumsum(np.nan_to_num(v))) / scene.width for c, (v, _) in fins.items()}

    def left(*of: Column) -> float:
        """Return the power of the rate's change beyond the rate's own and some columns."""
        return float(np.sum(beyond(np.stack([*beside, *(means[c] for c in of)], axis=1), grows) ** 2))

    alone = {c: 1.0 - left(c) / max(left(), 1e-300) for c in means}
    column = max(alone, key=lambda c: alone[c], default=None)
    if column is None or alone[column] < EXPLAINS:
        return
    # sway and roll follow the fin too: what counts is what the others do not explain as well
    every = [column, *(c for c in means if c != column and abs(_alike(means[c], means[column])[0]) < FOLLOWS)]
    own = {c: left(*(o for o in every if o != c)) - left(*every) for c in every}
    rival = max(every[1:], key=lambda c: own[c], default=None)
    if rival is not None and own[column] < CLEARLY * own[rival]:
        return
    beyond_it = (
        "" if rival is None else f", {own[column] / max(own[rival], 1e-9):.3g} times what column {rival} adds to the others"
    )
    why = f"it explains {100 * alone[column]:.0f} % of what the yaw rate's change has beside the rate's own{beyond_it}"
    yield Recognised("rudder_rad", column, fins[column][1], why)


def _deflected(values: FloatArray) -> tuple[FloatArray, dict[str, Any]] | None:
    """Return numbers (n,) of both sides of zero, or of a servo's centre, with how they are read; None where they are neither."""
    servo = servo_of(values)
    centred = values if servo is None else values - servo.centre
    low, high = float(np.nanmin(centred)), float(np.nanmax(centred))
    if not (low < 0.0 < high and min(-low, high) > 0.2 * max(-low, high) and (high < 90.0 or servo is not None)):
        return None
    return centred, {"unit": "deg" if high > 1.6 else "rad"} if servo is None else {"unit": COUNTS, "centre": round(servo.centre)}
