"""The recognition of signals by their numbers, where no name identifies a column, from physical relations to other signals.

A heading agrees with the course of two columns of metres. A rate is the derivative of its angle. A speed is the distance per
second. A fin delta explains the part of the angular acceleration that the rate does not: dr/dt = a r + b delta. A signal is
accepted only where its relation is clear, with a note that states the number.
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
from fieldsid.logs.doctor.angle_and_rate import STRONG
from fieldsid.logs.doctor.together import FEWEST, change, width_of
from fieldsid.logs.few_of import FEW, few_of
from fieldsid.logs.mapping.fins.shares import EXPLAINS, beyond, explained, explains, moved_by
from fieldsid.logs.mapping.fins.shares import WINDOWS_S as SHORT_S
from fieldsid.logs.mapping.numbers.unit_inference import Reading, fin_reading, in_radians
from fieldsid.logs.reader import Samples
from fieldsid.logs.run import RATE_OF
from fieldsid.numerics.arrays import ComplexArray, FloatArray
from fieldsid.numerics.shifted_correlation import slope_of

WINDOWS_S = (*SHORT_S, 10.0)
"""Windows in s over which changes are computed; a position with few digits needs a long one."""
TURNS_ALONG = 0.6
"""Smallest correlation of heading and course."""
MOST_SLIP = 3.0
"""Largest ratio of the turns of heading and course, in either direction; they differ by sideslip."""
MOST_WAYS = 30
ONE_SIDED = 0.2
"""Smallest ratio of the largest fin angles to the two sides."""
VARIES_WITHIN, IS_WITHIN = 0.3, 0.1
"""Largest mean relative deviation of a column from its prediction: of changes, which are noisy, and of a level."""
GLOBE = (90.0, 180.0)
"""Largest latitude and longitude in degrees; the first is also that of a pitch or a roll."""
AT_REST = 1e-3
"""A median speed below this cannot be in m/s, and always is so in degrees of latitude and longitude per s."""
MOST_COLUMNS = 40
PLACE = ("x_m", "y_m")
"""The signals of a position; the columns may also be latitude and longitude in degrees, see `is_geographic`."""
Column = str | int


@dataclass(frozen=True, slots=True)
class Recognised:
    """A recognised signal: its column, its line in a mapping, the reason in words, and the quality of the fit from 0 to 1."""

    signal: str
    column: Column
    item: Mapping[str, Any]
    why: str
    trust: float


@dataclass(frozen=True, slots=True)
class _Scene:
    """The columns of a table over windows of `width` samples: known ones by signal, free ones, and the signals found so far."""

    samples: Samples
    width: int
    known: Mapping[str, Column]
    free: list[Column]
    found: tuple[Recognised, ...] = ()

    def with_found(self, found: Iterable[Recognised]) -> _Scene:
        more = tuple(found)
        taken = {r.column for r in more}
        known = {**self.known, **{r.signal: r.column for r in more}}
        return replace(self, known=known, free=[c for c in self.free if c not in taken], found=self.found + more)

    def values(self, column: Column) -> FloatArray:
        """Return a column (n,) without conversion."""
        return self.samples.columns[column]

    @property
    def window_s(self) -> FloatArray:
        """The duration of the window about each sample in s, NaN where it is not positive."""
        found = change(self.samples.time, self.width)
        return np.where(found > 0.0, found, np.nan)

    def is_geographic(self, x: Column, y: Column) -> bool:
        """Return whether two columns are latitude and longitude in degrees: in their range, and too slow for a position in m."""
        columns = (self.values(x), self.values(y))
        if any(float(np.nanmax(np.abs(c))) > limit for c, limit in zip(columns, GLOBE, strict=True)):
            return False
        fast = np.hypot(*(change(c, self.width) for c in columns)) / self.window_s
        return bool(np.isfinite(fast).any()) and 0.0 < float(np.nanmedian(fast)) < AT_REST

    def displacement(self, x: Column, y: Column) -> ComplexArray:
        """Return the displacement (n,) in m over the window, x + iy, from two columns in m or of latitude and longitude."""
        places = self.values(x), self.values(y)
        x_m, y_m = north_and_east(np.stack(places, axis=1)) if self.is_geographic(x, y) else places
        return change(x_m + 1j * y_m, self.width)

    def speed(self) -> ComplexArray:
        """Return the velocity (n,) in m/s, along the heading (real part) and across it (imaginary part)."""
        along = self.displacement(*(self.known[s] for s in PLACE)) * np.exp(-1j * self.angle("yaw_rad"))
        return np.asarray(along * (1.0 / self.window_s))

    def angle(self, signal: str) -> FloatArray:
        """Return a known angle (n,) in rad, unwrapped; its unit is the one found, else it follows from its size."""
        values = self.values(self.known[signal])
        unit = next((r.item["unit"] for r in self.found if r.signal == signal), None)
        return np.unwrap(np.where(np.isfinite(values), in_radians(values, unit), 0.0))

    def turned(self, signal: str) -> FloatArray:
        """Return the change (n,) in rad of a known angle over the window, less its mean."""
        return self.varied(self.angle(signal))

    def varied(self, values: FloatArray) -> FloatArray:
        """Return the change (n,) of numbers over the window, less its mean."""
        found = change(values, self.width)
        return found - np.nanmean(found)

    def integral_change(self, column: Column) -> FloatArray:
        """Return the integral (n,) of a column over the window less its mean, which would be the offset of a sensor."""
        time = self.samples.time
        return self.varied(np.cumsum(np.nan_to_num(self.values(column)) * np.diff(time, prepend=time[0])))


@dataclass(frozen=True, slots=True)
class _Tie:
    """A relation of a signal to those it `needs`: `made` predicts numbers (n,) that `by` computes from its column."""

    signal: str
    needs: tuple[str, ...]
    made: Callable[[_Scene], FloatArray]
    by: Callable[[_Scene, Column], FloatArray]
    units: tuple[str, ...]
    says: str
    within: float = VARIES_WITHIN
    may_turn: bool = False


TIES = (
    *(_Tie(rate, (angle,), partial(_Scene.turned, signal=angle), _Scene.integral_change, ("rad/s", "deg/s"),
           f"the derivative of column {{{angle}}}", may_turn=True) for angle, rate in RATE_OF.items()),
    _Tie("surge_m_s", ("yaw_rad", *PLACE), lambda s: s.speed().real, _Scene.values, ("m/s", "kn"),
         "the way made along the heading", IS_WITHIN),
    _Tie("sway_m_s", ("yaw_rad", *PLACE, "surge_m_s"), lambda s: s.speed().imag, _Scene.values, ("m/s", "kn"),
         "the way made across the heading"),
)  # fmt: skip
"""The relations of signals to known ones, in the order in which they are tried."""


def recognised(samples: Samples, known: Mapping[str, Column], free: list[Column]) -> tuple[Recognised, ...]:
    """Return the signals recognised among the columns without a known name (`free`), given those known by name.

    Of the results for several assignments of heading and position, and several windows, the one with the largest sum of the
    qualities of fit is returned.
    """
    best: tuple[Recognised, ...] = ()
    moving = [c for c in free if _moves(samples.columns[c])] if len(free) <= MOST_COLUMNS else []
    widths = (width_of(samples.time, window) for window in WINDOWS_S)
    for scene in (_Scene(samples, width, known, moving) for width in widths if samples.time.size > width + FEWEST):
        for displacement in _assignments(scene):
            seen = scene.with_found(displacement)
            for tie in TIES:
                seen = seen.with_found(_tied(seen, tie))
            best = max(best, seen.with_found(_fin(seen)).found, key=lambda found: sum(r.trust for r in found))
    return best


def _moves(values: FloatArray) -> bool:
    return bool(np.isfinite(values).mean() > 0.5) and float(np.nanmax(values) - np.nanmin(values)) > 0.0


def _tied(scene: _Scene, tie: _Tie) -> Iterator[Recognised]:
    """Yield the free column that fits a relation best, in its unit and sign, where it deviates little enough."""
    if tie.signal in scene.known or not set(tie.needs) <= scene.known.keys():
        return
    made, fits = tie.made(scene), []
    for column in scene.free:
        values = tie.by(scene, column)
        good = np.isfinite(values) & np.isfinite(made)
        size = float(np.abs(made[good]).sum())
        for unit, sign in product(tie.units, (1, -1) if tie.may_turn else (1,)) if good.sum() >= FEWEST and size > 0.0 else ():
            off = float(np.abs(sign * UNITS[unit].factor * values[good] - made[good]).sum()) / size
            fits.append((off, column, {"unit": unit} | ({"sign": -1} if sign < 0 else {})))
    off, column, item = min(fits, key=lambda fit: fit[0], default=(math.inf, "", {}))
    if off <= tie.within:
        why = f"it is {tie.says.format(**scene.known)} within {100 * off:.1f} %"
        yield Recognised(tie.signal, column, item, why, 1.0 - off)


def _assignments(scene: _Scene) -> list[list[Recognised]]:
    """Return the possible assignments of heading, x and y, the likeliest first: those in which heading and course agree.

    Where there are none, the headings that exceed any pitch or roll and have a derivative; else an empty assignment.
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
    found = [displacement for place in places for displacement in _pointing(scene, place, toward)]
    turning = [
        [Recognised("yaw_rad", c, {"unit": "deg"}, f"it goes to {largest:.4g}, beyond tilts, and has a derivative", rate.trust)]
        for c, rate in rates.items()
        if (largest := float(np.nanmax(np.abs(scene.values(c))))) > GLOBE[0] and "sign" not in rate.item
    ]
    return sorted(found, key=lambda displacement: -displacement[0].trust)[:MOST_WAYS] or turning or [[]]


def _pointing(
    scene: _Scene, place: tuple[Column, ...], toward: Mapping[tuple[Column, str], ComplexArray]
) -> Iterator[list[Recognised]]:
    """Yield the assignments of heading, x and y in which the displacement of two columns points `toward` (n,) a heading."""
    displacement = scene.displacement(*place)
    seen = np.isfinite(displacement)
    made = float(np.abs(displacement[seen]).sum())
    if not float(np.median(np.abs(displacement[seen]))) > 0.0:
        return
    item = {"unit": "deg"} if scene.is_geographic(*place) else {}
    for (heading, unit), direction in toward.items():
        along = float(np.vdot(direction[seen], displacement[seen]).real) / made
        if heading in place or along <= STRONG:  # of the distance is made along the heading, but for sideslip
            continue
        slope, trust = slope_of(*(np.unwrap(np.angle(v[seen])) for v in (direction, displacement)))
        if trust > TURNS_ALONG and 1.0 / MOST_SLIP < slope < MOST_SLIP:
            why = f"{100 * along:.1f} % of the way that columns {' and '.join(map(str, place))} make is made along it"
            same = f"the way made in it is along the heading in column {heading}"
            of_place = [Recognised(s, c, item, same, along) for s, c in zip(PLACE, place, strict=True) if s not in scene.known]
            yield [Recognised("yaw_rad", heading, {"unit": unit}, f"{why}, correlation {trust:.3f}", trust), *of_place]


def _fin(scene: _Scene) -> list[Recognised]:
    """Return the rudder: of the columns about zero, the one that explains the part of dr/dt that r does not.

    The shortest conclusive window is used: over a long one the roll of a ship is correlated with dr/dt as its rudder is.
    """
    known, fins = scene.known, {c: fin for c in scene.free if (fin := _deflected(scene.values(c))) is not None}
    if {"rudder_rad", "rudder_measured_rad"} & known.keys() or not {"yaw_rad", "yaw_rate_rad_s"} & known.keys() or not fins:
        return []
    rate = np.nan_to_num(scene.values(known["yaw_rate_rad_s"])) if "yaw_rate_rad_s" in known else None
    angle = scene.angle("yaw_rad") if "yaw_rad" in known else None
    angles = [np.nan_to_num(scene.values(c)) - fin.centre for c, fin in fins.items()]
    for width in (width_of(scene.samples.time, window) for window in WINDOWS_S):
        terms = moved_by(angles, scene.samples.time, rate, angle, width, rights=False)
        best = _fin_column(list(fins), angles, *terms, width) if terms is not None else None
        if best is not None:
            column, why, trust = best
            return [Recognised("rudder_rad", column, fins[column].item, why, trust)]
    return []


def _fin_column(
    names: list[Column], angles: list[FloatArray], grows: FloatArray, moved: FloatArray, width: int
) -> tuple[Column, str, float] | None:
    """Return the column that explains a rate, from the results of `moved_by`, with the reason and the share; None without one."""

    def left(of: list[int]) -> float:
        """Return the share of dr/dt that some columns do not explain."""
        return float(np.sum(beyond(moved[:, of], grows) ** 2) / np.sum(grows**2))

    alone = [explained(grows, column, width) for column in moved.T]
    best = int(np.argmax(alone))
    # sway and roll are correlated with the fin: only the part that the other columns do not explain counts
    every = [best, *(i for i in range(len(names)) if i != best and slope_of(angles[i], angles[best])[1] < 1.0 - FEW)]
    added = {i: left([o for o in every if o != i]) - left(every) for i in every if len(every) > 1}
    rival = max(every[1:], key=lambda i: added[i], default=None)
    if alone[best] < EXPLAINS or (rival is not None and added[best] < CLEARLY * added[rival]):
        return None
    why = f"it explains {explains(alone[best], 'yaw_rate')}"
    if rival is not None:
        why += f", and adds {100 * added[best]:.0f} % to the others, column {names[rival]} {100 * added[rival]:.0f} %"
    alike = [f"column {name}" for i, name in enumerate(names) if i not in every]
    if alike:
        why += f"; {few_of(alike)} moves as it does: the command is the one that leads, and the other is `rudder_measured_rad`"
    return names[best], why, alone[best]


def _deflected(values: FloatArray) -> Reading | None:
    """Return the conversion of numbers (n,) on both sides of zero, or of the centre of a servo, as a fin; else None."""
    fin = fin_reading(values)
    if fin is None:
        return None
    low, high = (fin.worth * (float(end) - fin.centre) for end in (np.nanmin(values), np.nanmax(values)))
    return fin if low < 0.0 < high < 0.5 * math.pi and min(-low, high) > ONE_SIDED * max(-low, high) else None
