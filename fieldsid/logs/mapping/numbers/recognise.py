"""Signals known by their numbers, where no name says what a column is: each by what physics ties it to the others.

A heading points the way made: the course of two columns of metres. A rate is the derivative of its angle. A speed is the way
made in a second. A fin is what the turning that neither rate nor speed explains follows: r' = a r + b delta. Each is believed
only where it stands out, and comes with the number that says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations, product
from typing import Any

import numpy as np

from fieldsid.logs.convert.frames import north_and_east
from fieldsid.logs.convert.units import CLEARLY, UNITS
from fieldsid.logs.doctor.angle_and_rate import PAIRS
from fieldsid.logs.doctor.together import FEWEST, change, width_of
from fieldsid.logs.mapping.fins.shares import EXPLAINS, beyond, explained, explains, moved_by
from fieldsid.logs.mapping.fins.shares import WINDOWS_S as SHORT_S
from fieldsid.logs.mapping.numbers.units_told import Reading, fin_reading, in_radians
from fieldsid.logs.reader import Samples
from fieldsid.numerics.arrays import ComplexArray, FloatArray
from fieldsid.numerics.shifted_correlation import slope_of

WINDOWS_S = (*SHORT_S, 10.0)
"""Times over which changes are taken: a position with few digits shows its way in a long one."""
SAME_WAY = 0.9
"""Share of the way that is made along the heading: sideslip keeps it from one."""
TURNS_ALONG = 0.6
"""Correlation of heading and course from which on one turns with the other."""
MOST_SLIP = 3.0
"""How many times as far a heading may turn as its course, or the course as the heading: sideslip lies between them."""
MOST_WAYS = 30
BEYOND_TILTS_DEG = 90.0
ALIKE = 0.95
"""Correlation of two columns that are one signal twice."""
ONE_SIDED = 0.2
"""How far a fin goes to one side at least, against the other."""
VARIES_WITHIN, IS_WITHIN = 0.3, 0.1
"""Share by which a column may miss in the mean what it should make: changes, under noise, and a level, which others are near."""
GLOBE = (90.0, 180.0)
"""Largest latitude and longitude in degrees."""
AT_REST = 1e-3
"""A way of less than this in a second is no vehicle's in m, and every vehicle's in degrees of latitude and longitude."""
MOST_COLUMNS = 40
PLACE = ("x_m", "y_m")
"""Of degrees too, which `is_geographic` tells."""
Column = str | int


@dataclass(frozen=True, slots=True)
class Recognised:
    """A signal, the column that it is, how it is to be read, why, and how well it fits from 0 to 1."""

    signal: str
    column: Column
    item: Mapping[str, Any]
    why: str
    trust: float


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

    def values(self, column: Column) -> FloatArray:
        """Return a column (n,) as it is."""
        return self.samples.columns[column]

    @property
    def passed(self) -> FloatArray:
        """The time that passes over the window, NaN where it stands still."""
        found = change(self.samples.time, self.width)
        return np.where(found > 0.0, found, np.nan)

    def is_geographic(self, x: Column, y: Column) -> bool:
        """Whether two columns are a latitude and a longitude in degrees: on the globe, and as slow as no way in m is."""
        columns = (self.values(x), self.values(y))
        if any(float(np.nanmax(np.abs(c))) > limit for c, limit in zip(columns, GLOBE, strict=True)):
            return False
        fast = np.hypot(*(change(c, self.width) for c in columns)) / self.passed
        return bool(np.isfinite(fast).any()) and 0.0 < float(np.nanmedian(fast)) < AT_REST

    def way(self, x: Column, y: Column) -> ComplexArray:
        """Return the way in m (n,) over the window by two columns, x real: metres, or degrees of latitude and longitude."""
        places = self.values(x), self.values(y)
        x_m, y_m = north_and_east(np.stack(places, axis=1)) if self.is_geographic(x, y) else places
        return change(x_m + 1j * y_m, self.width)

    def speed(self) -> ComplexArray:
        """Return the way made in a second (n,) along the heading, real, and across it."""
        along = self.way(*(self.known[s] for s in PLACE)) * np.exp(-1j * self.angle("yaw_rad"))
        return np.asarray(along * (1.0 / self.passed))

    def angle(self, signal: str) -> FloatArray:
        """Return an angle that is known (n,) in rad, unwrapped: in the unit in which it was found, else by its size."""
        values = self.values(self.known[signal])
        unit = next((r.item["unit"] for r in self.found if r.signal == signal), None)
        return np.unwrap(np.where(np.isfinite(values), in_radians(values, unit), 0.0))

    def turned(self, signal: str) -> FloatArray:
        """Return how the change over the window varies of an angle that is known."""
        return self.varied(self.angle(signal))

    def varied(self, values: FloatArray) -> FloatArray:
        """Return the change of numbers (n,) over the window, less its mean."""
        found = change(values, self.width)
        return found - np.nanmean(found)

    def swept(self, column: Column) -> FloatArray:
        """Return how the integral of a column over the window varies: what it adds steadily is a sensor's offset."""
        time = self.samples.time
        return self.varied(np.cumsum(np.nan_to_num(self.values(column)) * np.diff(time, prepend=time[0])))


@dataclass(frozen=True, slots=True)
class _Tie:
    """What ties a signal to those it `needs`: the numbers (n,) that its column makes `by` some way, in some unit and sign."""

    signal: str
    needs: tuple[str, ...]
    made: Callable[[_Scene], FloatArray]
    by: Callable[[_Scene, Column], FloatArray]
    units: tuple[str, ...]
    says: str
    within: float = VARIES_WITHIN
    signs: tuple[int, ...] = (1,)


TIES = (
    *(_Tie(rate, (angle,), partial(_Scene.turned, signal=angle), _Scene.swept, ("rad/s", "deg/s"),
           f"the derivative of column {{{angle}}}", signs=(1, -1)) for angle, rate in PAIRS),
    _Tie("surge_m_s", ("yaw_rad", *PLACE), lambda s: s.speed().real, _Scene.values, ("m/s", "kn"),
         "the way made along the heading", IS_WITHIN),
    _Tie("sway_m_s", ("yaw_rad", *PLACE, "surge_m_s"), lambda s: s.speed().imag, _Scene.values, ("m/s", "kn"),
         "the way made across the heading"),
)  # fmt: skip
"""What a column is by those that are known already, in this order."""


def recognised(samples: Samples, known: Mapping[str, Column], free: list[Column]) -> tuple[Recognised, ...]:
    """Return signals among the columns that nobody named (`free`), beside those that are known by name.

    Of what several ways and windows would give, that in which the most columns find their place among the others, and fit there
    best, is taken.
    """
    best: tuple[Recognised, ...] = ()
    moving = [c for c in free if _moves(samples.columns[c])] if len(free) <= MOST_COLUMNS else []
    widths = (width_of(samples.time, window) for window in WINDOWS_S)
    for scene in (_Scene(samples, width, known, moving) for width in widths if samples.time.size > width + FEWEST):
        for way in _ways(scene):
            seen = scene.knowing(way)
            for tie in TIES:
                seen = seen.knowing(_tied(seen, tie))
            best = max(best, seen.knowing(_fin(seen)).found, key=lambda found: sum(r.trust for r in found))
    return best


def _moves(values: FloatArray) -> bool:
    return bool(np.isfinite(values).mean() > 0.5) and float(np.nanmax(values) - np.nanmin(values)) > 0.0


def _tied(scene: _Scene, tie: _Tie) -> Iterator[Recognised]:
    """Yield the free column that a tie says to be its signal: in its unit and sign it misses what it should make by least."""
    if tie.signal in scene.known or not set(tie.needs) <= scene.known.keys():
        return
    made, fits = tie.made(scene), []
    for column in scene.free:
        values = tie.by(scene, column)
        good = np.isfinite(values) & np.isfinite(made)
        size = float(np.abs(made[good]).sum())
        for unit, sign in product(tie.units, tie.signs) if good.sum() >= FEWEST and size > 0.0 else ():
            off = float(np.abs(sign * UNITS[unit].factor * values[good] - made[good]).sum()) / size
            fits.append((off, column, {"unit": unit} | ({"sign": -1} if sign < 0 else {})))
    off, column, item = min(fits, key=lambda fit: fit[0], default=(math.inf, "", {}))
    if off <= tie.within:
        why = f"it is {tie.says.format(**scene.known)} within {100 * off:.1f} %"
        yield Recognised(tie.signal, column, item, why, 1.0 - off)


def _ways(scene: _Scene) -> list[list[Recognised]]:
    """Return what heading, x and y may be, the likeliest first: triples in which the heading points the way made.

    Where none does, headings that go beyond what tilts do, and have a derivative; or nothing.
    """
    if "yaw_rad" in scene.known:
        return [[]]
    alone = (replace(scene, known={"yaw_rad": c}, free=[o for o in scene.free if o != c]) for c in scene.free)
    rates = {pair.known["yaw_rad"]: rate for pair in alone for rate in _tied(pair, TIES[0])}
    toward = {
        (c, unit): np.nan_to_num(np.exp(1j * in_radians(scene.values(c), unit)))
        for c in rates or scene.free
        for unit in ("deg", "rad")
    }
    known = tuple(scene.known[s] for s in PLACE if s in scene.known)
    places = [known] if len(known) == len(PLACE) else permutations(scene.free, 2) if not known else []
    found = [way for place in places for way in _pointing(scene, place, toward)]
    turning = [
        [Recognised("yaw_rad", c, {"unit": "deg"}, f"it goes to {largest:.4g}, beyond tilts, and has a derivative", rate.trust)]
        for c, rate in rates.items()
        if (largest := float(np.nanmax(np.abs(scene.values(c))))) > BEYOND_TILTS_DEG and "sign" not in rate.item
    ]
    return sorted(found, key=lambda way: -way[0].trust)[:MOST_WAYS] or turning or [[]]


def _pointing(
    scene: _Scene, place: tuple[Column, ...], toward: Mapping[tuple[Column, str], ComplexArray]
) -> Iterator[list[Recognised]]:
    """Yield what a heading, x and y are, where the way that two columns make is made `toward` (n,) a third, in some unit."""
    way = scene.way(*place)
    seen = np.isfinite(way)
    made = float(np.abs(way[seen]).sum())
    if not made > 0.0 or not float(np.median(np.abs(way[seen]))) > 0.0:
        return
    item = {"unit": "deg"} if scene.is_geographic(*place) else {}
    for (heading, unit), direction in toward.items():
        along = float(np.vdot(direction[seen], way[seen]).real) / made
        if heading in place or along <= SAME_WAY:
            continue
        slope, trust = slope_of(*(np.unwrap(np.angle(v[seen])) for v in (direction, way)))
        if trust > TURNS_ALONG and 1.0 / MOST_SLIP < slope < MOST_SLIP:
            why = f"{100 * along:.1f} % of the way that columns {' and '.join(map(str, place))} make is made along it"
            same = f"the way made in it is along the heading in column {heading}"
            of_place = [Recognised(s, c, item, same, along) for s, c in zip(PLACE, place, strict=True) if s not in scene.known]
            yield [Recognised("yaw_rad", heading, {"unit": unit}, f"{why}, correlation {trust:.3f}", trust), *of_place]


def _fin(scene: _Scene) -> list[Recognised]:
    """Return the rudder: of the columns about zero that which the change of the yaw rate follows beside the rate itself.

    The shortest window counts that tells it: over a long one a ship's roll goes with the yaw rate's change as its rudder does.
    """
    known, fins = scene.known, {c: fin for c in scene.free if (fin := _deflected(scene.values(c))) is not None}
    if {"rudder_rad", "rudder_measured_rad"} & known.keys() or not {"yaw_rad", "yaw_rate_rad_s"} & known.keys() or not fins:
        return []
    rate = np.nan_to_num(scene.values(known["yaw_rate_rad_s"])) if "yaw_rate_rad_s" in known else None
    angle = scene.angle("yaw_rad") if "yaw_rad" in known else None
    angles = [np.nan_to_num(scene.values(c)) - fin.centre for c, fin in fins.items()]
    for width in (width_of(scene.samples.time, window) for window in WINDOWS_S):
        told = moved_by(angles, scene.samples.time, rate, angle, width, rights=False)
        best = _moving(list(fins), angles, *told, width) if told is not None else None
        if best is not None:
            column, why, trust = best
            return [Recognised("rudder_rad", column, fins[column].item, why, trust)]
    return []


def _moving(
    names: list[Column], angles: list[FloatArray], grows: FloatArray, moved: FloatArray, width: int
) -> tuple[Column, str, float] | None:
    """Return which of some columns (n,) moves a rate by what `moved_by` gives of them, why, and how well; None for none."""

    def left(of: list[int]) -> float:
        """Return the share of the rate's change that some columns leave."""
        return float(np.sum(beyond(moved[:, of], grows) ** 2) / np.sum(grows**2))

    alone = [explained(grows, column, width) for column in moved.T]
    best = int(np.argmax(alone))
    # sway and roll follow the fin too: what counts is what the others do not explain as well
    every = [best, *(i for i in range(len(names)) if i != best and slope_of(angles[i], angles[best])[1] < ALIKE)]
    own = {i: left([o for o in every if o != i]) - left(every) for i in every if len(every) > 1}
    rival = max(every[1:], key=lambda i: own[i], default=None)
    if alone[best] < EXPLAINS or (rival is not None and own[best] < CLEARLY * own[rival]):
        return None
    why = f"it explains {explains(alone[best], 'yaw_rate')}"
    if rival is not None:
        why += f", and adds {100 * own[best]:.0f} % to the others, column {names[rival]} {100 * own[rival]:.0f} %"
    return names[best], why, alone[best]


def _deflected(values: FloatArray) -> Reading | None:
    """Return how numbers (n,) of both sides of zero, or of a servo's centre, are read as a fin's; None where they are neither."""
    fin = fin_reading(values)
    if fin is None:
        return None
    low, high = (fin.worth * (float(end) - fin.centre) for end in (np.nanmin(values), np.nanmax(values)))
    return fin if low < 0.0 < high < 0.5 * math.pi and min(-low, high) > ONE_SIDED * max(-low, high) else None
