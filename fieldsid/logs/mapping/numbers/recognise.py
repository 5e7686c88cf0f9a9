"""Signals known by their numbers, where no name says what a column is: each by what physics ties it to the others.

A heading points the way made: the course of two columns of metres. A rate is the derivative of its angle. A speed is the way
made in a second. A fin is what the turning that neither rate nor speed explains follows: r' = a r + b delta. Each is believed
only where it stands out, and comes with the number that says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.servo_counts import COUNTS, servo_of
from fieldsid.logs.convert.units import KNOT
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
WITHIN = 0.1
"""Share of the speed by which the way made along the heading may differ from it."""
SPEEDS = {"m/s": 1.0, "kn": KNOT}
MOST_COLUMNS = 40
ComplexArray = npt.NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Recognised:
    """A signal, the column that it is, how it is to be read, why, and the correlation behind it."""

    signal: str
    column: str | int
    item: Mapping[str, Any]
    why: str
    trust: float = 0.0


def recognised(samples: Samples, known: Mapping[str, str | int], free: list[str | int]) -> list[Recognised]:
    """Return signals among the columns that nobody named (`free`), beside those that are known by name.

    Of what several ways and windows would give, that in which the most columns find their place among the others is taken, and
    of those the one in which the rate is the heading's derivative best: that is exact, while a course is off by the sideslip.
    """
    usual = np.diff(samples.time[np.isfinite(samples.time)])
    if usual.size < 50 or len(free) > MOST_COLUMNS:
        return []
    moving = [c for c in free if _moves(samples.columns[c])]
    best: list[Recognised] = []
    for window in WINDOWS_S:
        scene = _Scene(samples, max(1, round(window / float(np.median(usual)))), moving)
        for way in _ways(scene, known):
            found = _beside(scene, known, way)
            best = found if _worth(found) > _worth(best) else best
    return best


def _worth(found: list[Recognised]) -> tuple[int, float]:
    return len(found), round(max((r.trust for r in found), default=0.0), ndigits=3)


def unit_of_heading(samples: Samples, heading: str | int, position: tuple[str | int, str | int]) -> str | None:
    """Return the unit in which a heading points along the way made; None where it does so in none."""
    steps = np.diff(samples.time)
    if steps.size < 50:
        return None
    scene = _Scene(samples, max(1, round(WINDOWS_S[0] / float(np.median(steps)))), [])
    x, y = (scene.changes(samples.columns[c]) for c in position)
    middle = np.nan_to_num(samples.columns[heading][scene.width // 2 :][: x.size])
    found = max(_pointing(heading, position, middle, x + 1j * y), key=lambda f: f[0], default=None)
    return None if found is None else str(found[1][0].item["unit"])


def _beside(scene: _Scene, known: Mapping[str, str | int], way: list[Recognised]) -> list[Recognised]:
    """Return a way with the rates, the speed and the fin that go with it."""
    found = list(way)
    for step in (_rate, _speed, _fin):
        taken = dict(known) | {r.signal: r.column for r in found}
        found += step(scene, taken, [c for c in scene.free if c not in taken.values()], found)
    return found


@dataclass(frozen=True, slots=True)
class _Scene:
    samples: Samples
    width: int
    free: list[str | int]

    def changes(self, values: FloatArray) -> FloatArray:
        """Return the change of a column (n,) over the window."""
        return np.asarray(values[self.width :] - values[: -self.width])

    @property
    def passed(self) -> FloatArray:
        """The time that passes over the window."""
        return self.changes(self.samples.time)


def _moves(values: FloatArray) -> bool:
    return bool(np.isfinite(values).mean() > 0.5) and float(np.nanmax(values) - np.nanmin(values)) > 0.0


def _ways(scene: _Scene, known: Mapping[str, str | int]) -> list[list[Recognised]]:
    """Return what heading, x and y may be, the likeliest first: triples in which the heading points the way made; or nothing."""
    if "yaw_rad" in known or "x_m" in known:
        return [[]]
    found: list[tuple[float, list[Recognised]]] = []
    way = {c: scene.changes(scene.samples.columns[c]) for c in scene.free}
    headings = _with_rates(scene)
    for x, y in permutations(scene.free, 2):
        made = np.hypot(way[x], way[y])
        if not np.isfinite(made).any() or not float(np.nanmedian(made)) > 0.0:
            continue
        for heading in headings:
            if heading not in (x, y):
                middle = np.nan_to_num(scene.samples.columns[heading][scene.width // 2 :][: made.size])
                found += _pointing(heading, (x, y), middle, way[x] + 1j * way[y])
    ways = [way for _, way in sorted(found, key=lambda f: -f[0])[:MOST_WAYS]]
    return ways or [[heading] for heading in _going_round(scene)] or [[]]


def _going_round(scene: _Scene) -> list[Recognised]:
    """Return the columns that may be a heading though no way is logged: they go beyond what tilts do, and have a derivative."""
    found = []
    for column in scene.free:
        largest = float(np.nanmax(np.abs(scene.samples.columns[column])))
        turned = scene.changes(np.unwrap(np.radians(np.nan_to_num(scene.samples.columns[column]))))
        pairs = [(_alike(turned, _swept(scene, c)), c) for c in scene.free if c != column and largest > BEYOND_TILTS_DEG]
        (trust, slope), rate = max(pairs, key=lambda p: p[0][0], default=((0.0, 0.0), ""))
        if _is_rate(trust, slope):
            why = f"it goes to {largest:.4g}, beyond tilts, and column {rate} is its derivative, correlation {trust:.3f}"
            found.append(Recognised("yaw_rad", column, {"unit": "deg"}, why, trust))
    return found


def _with_rates(scene: _Scene) -> list[str | int]:
    """Return the columns that may be angles: those of which another is the derivative, all where there are none."""
    turned = {c: scene.changes(np.nan_to_num(scene.samples.columns[c])) for c in scene.free}
    swept = {c: _swept(scene, c) for c in scene.free}
    pairs = {a for a, r in permutations(scene.free, 2) if _is_rate(*_alike(turned[a], swept[r]))}
    return [c for c in scene.free if c in pairs] or scene.free


def _is_rate(trust: float, slope: float) -> bool:
    return abs(trust) > FOLLOWS and any(abs(abs(slope) * f - 1.0) < 0.2 for f in (1.0, UNITS["deg"], 1.0 / UNITS["deg"]))


def _pointing(
    heading: str | int, position: tuple[str | int, str | int], values: FloatArray, way: ComplexArray
) -> Iterator[tuple[float, list[Recognised]]]:
    """Yield how much of a way (m,) is made along a column (m,) taken as a heading, with what that says."""
    x, y = position
    seen = np.isfinite(way)
    made = float(np.abs(way[seen]).sum())
    course = np.unwrap(np.angle(way[seen]))
    for unit, factor in UNITS.items():
        angle = factor * values[seen]
        along = float((way[seen] * np.exp(-1j * angle)).real.sum()) / made
        trust, slope = _alike(np.unwrap(angle), course)
        if along > SAME_WAY and trust > TURNS_ALONG and 1.0 / MOST_SLIP < slope < MOST_SLIP:
            why = f"{100 * along:.1f} % of the way that columns {x} and {y} make is made along it, correlation {trust:.3f}"
            same = f"the way made in it is along the heading in column {heading}"
            yaw = Recognised("yaw_rad", heading, {"unit": unit}, why)
            yield trust, [yaw, Recognised("x_m", x, {}, same), Recognised("y_m", y, {}, same)]


def _rate(scene: _Scene, known: Mapping[str, str | int], free: list[str | int], before: list[Recognised]) -> Iterator[Recognised]:
    """Yield the rates of the angles that are known: the columns whose sums over the window are the angle's change."""
    for angle, rate in (("yaw_rad", "yaw_rate_rad_s"), ("pitch_rad", "pitch_rate_rad_s"), ("roll_rad", "roll_rate_rad_s")):
        if angle not in known or rate in known:
            continue
        turned = scene.changes(np.unwrap(_radians(scene, known[angle], angle, before)))
        best = max(((_alike(turned, _swept(scene, c)), c) for c in free), key=lambda f: abs(f[0][0]), default=None)
        if best is None or abs(best[0][0]) < FOLLOWS:
            continue
        (trust, slope), column = best
        unit = next((u for u, factor in UNITS.items() if 0.7 < abs(slope) / factor < 1.4), None)
        if unit is not None:
            item = {"unit": f"{unit}/s"} | ({"sign": -1} if trust < 0.0 else {})
            yield Recognised(
                rate, column, item, f"it is the derivative of column {known[angle]}, correlation {trust:.3f}", abs(trust)
            )


def _radians(scene: _Scene, column: str | int, signal: str, before: list[Recognised]) -> FloatArray:
    unit = next((r.item.get("unit", "rad") for r in before if r.signal == signal), None)
    values = scene.samples.columns[column]
    if unit is None:
        unit = "deg" if float(np.nanmax(np.abs(values))) > 2.0 * math.pi + 0.1 else "rad"
    return np.asarray(np.where(np.isfinite(values), UNITS[unit] * values, 0.0))


def _swept(scene: _Scene, column: str | int) -> FloatArray:
    values, time = scene.samples.columns[column], scene.samples.time
    steps = np.diff(np.nan_to_num(time), prepend=time[0])
    return scene.changes(np.cumsum(np.nan_to_num(values) * steps))


def _alike(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Return the correlation of two columns (n,), and the slope of the first on the second."""
    good = np.isfinite(a) & np.isfinite(b)
    if good.sum() < 50 or float(np.ptp(a[good])) == 0.0 or float(np.ptp(b[good])) == 0.0:
        return 0.0, 0.0
    trust = float(np.corrcoef(a[good], b[good])[0, 1])
    return trust, math.copysign(float(np.std(a[good]) / np.std(b[good])), trust)


def _speed(
    scene: _Scene, known: Mapping[str, str | int], free: list[str | int], before: list[Recognised]
) -> Iterator[Recognised]:
    """Yield surge and sway: the columns that are the way made in a second along the heading and across it."""
    if "surge_m_s" in known or not {"x_m", "y_m", "yaw_rad"} <= known.keys():
        return
    x, y = (scene.changes(scene.samples.columns[known[s]]) for s in ("x_m", "y_m"))
    heading = _radians(scene, known["yaw_rad"], "yaw_rad", before)[scene.width // 2 :][: x.size]
    made = (x + 1j * y) * np.exp(-1j * heading) / scene.passed
    middle = {c: scene.samples.columns[c][scene.width // 2 :][: x.size] for c in free}
    along = float(np.nanmedian(np.abs(made)))
    ahead = [(float(np.nanmedian(np.abs(f * v - made.real))) / along, c, u) for c, v in middle.items() for u, f in SPEEDS.items()]
    best = min(ahead, key=lambda found: found[0], default=None)
    if best is None or not best[0] < WITHIN:
        return
    off, surge, unit = best
    yield Recognised("surge_m_s", surge, {"unit": unit}, f"it is the way made along the heading within {100 * off:.1f} %")
    across = [(_alike(SPEEDS[unit] * v, made.imag), c) for c, v in middle.items() if c != surge]
    (trust, slope), sway = max(across, key=lambda found: found[0][0], default=((0.0, 0.0), ""))
    if trust > FOLLOWS and 0.8 < slope < 1.25:
        yield Recognised("sway_m_s", sway, {"unit": unit}, f"it is the way made across the heading, correlation {trust:.3f}")


def _fin(scene: _Scene, known: Mapping[str, str | int], free: list[str | int], before: list[Recognised]) -> Iterator[Recognised]:
    """Yield the rudder: of the columns about zero that which the change of the yaw rate follows beside the rate itself."""
    if {"rudder_rad", "rudder_measured_rad"} & known.keys():
        return
    rate = _turning(scene, known, before)
    if rate is None:
        return
    grows = scene.changes(rate) / scene.passed
    middle = rate[scene.width // 2 :][: grows.size]
    deflected = {c: v for c in free if (v := _deflected(scene.samples.columns[c])) is not None}
    means = {c: _mean(scene, v) for c, (v, _) in deflected.items()}
    shares = sorted(((_explained(grows, [middle], v), c) for c, v in means.items()), key=lambda s: -s[0])
    if not shares or shares[0][0] < EXPLAINS:
        return
    share, column = shares[0]
    others = [c for c in means if c != column and abs(_alike(means[c], means[column])[0]) < FOLLOWS]
    own = {c: _explained_alone(grows, middle, means, c, [column, *others]) for c in (column, *others)}
    rival = max(others, key=lambda c: own[c], default=None)
    if rival is not None and own[column] < CLEARLY * own[rival]:
        return
    beside = "" if rival is None else f", {own[column] / max(own[rival], 1e-9):.3g} times what column {rival} adds to the others"
    why = f"it explains {100 * share:.0f} % of what the yaw rate's change has beside the rate's own{beside}"
    yield Recognised("rudder_rad", column, deflected[column][1], why)


def _turning(scene: _Scene, known: Mapping[str, str | int], before: list[Recognised]) -> FloatArray | None:
    if "yaw_rate_rad_s" in known:
        return np.nan_to_num(scene.samples.columns[known["yaw_rate_rad_s"]])
    if "yaw_rad" not in known:
        return None
    yaw = np.unwrap(_radians(scene, known["yaw_rad"], "yaw_rad", before))
    return np.gradient(yaw, np.nan_to_num(scene.samples.time) + 1e-9 * np.arange(yaw.size))


def _mean(scene: _Scene, values: FloatArray) -> FloatArray:
    """Return the mean (n,) of numbers over each window: what turns a rate over it."""
    return scene.changes(np.cumsum(np.nan_to_num(values))) / scene.width


def _deflected(values: FloatArray) -> tuple[FloatArray, dict[str, Any]] | None:
    """Return numbers (n,) of both sides of zero, or of a servo's centre, with how they are read; None where they are neither."""
    servo = servo_of(values)
    centred = values if servo is None else values - servo.centre
    low, high = float(np.nanmin(centred)), float(np.nanmax(centred))
    if not (low < 0.0 < high and min(-low, high) > 0.2 * max(-low, high) and (high < 90.0 or servo is not None)):
        return None
    if servo is not None:
        return centred, {"unit": COUNTS, "centre": round(servo.centre)}
    return centred, {"unit": "deg" if high > 1.6 else "rad"}


def moving_fin(samples: Samples, known: Mapping[str, str | int], outputs: list[str | int]) -> Recognised | None:
    """Return which of some outputs the yaw rate follows, where one does clearly; `known` has the yaw rate, or the heading."""
    usual = np.diff(samples.time)
    if usual.size < 50:
        return None
    moving = [c for c in outputs if _moves(samples.columns[c])]
    found = [
        fin
        for window in WINDOWS_S
        for fin in _fin(_Scene(samples, max(1, round(window / float(np.median(usual)))), moving), known, moving, [])
    ]
    return found[0] if found else None


def _explained_alone(
    grows: FloatArray, rate: FloatArray, means: Mapping[str | int, FloatArray], column: str | int, all_of: list[str | int]
) -> float:
    """Return the share of a rate's change (n,) that a column explains and no other of several: sway and roll follow the fin."""
    beside = [rate, *(means[c] for c in all_of if c != column)]
    left = _beyond(beside, grows)
    whole = _beyond([rate], grows)
    return _explained(grows, beside, means[column]) * float(left @ left) / max(float(whole @ whole), 1e-300)


def _explained(grows: FloatArray, beside: list[FloatArray], fin: FloatArray) -> float:
    """Return the share of what some columns (n,) leave of a rate's change that a fin explains."""
    left = [_beyond(beside, v) for v in (grows, fin)]
    powers = [float(v @ v) for v in left]
    return float(left[0] @ left[1]) ** 2 / (powers[0] * powers[1]) if min(powers) > 0.0 else 0.0


def _beyond(beside: list[FloatArray], values: FloatArray) -> FloatArray:
    """Return what columns (n,) and a constant leave of values."""
    base = np.stack([np.ones_like(values), *beside], axis=1)
    size = np.linalg.norm(base, axis=0)
    base = base / np.where(size > 0.0, size, 1.0)
    return np.asarray(values - base @ np.linalg.lstsq(base, values, rcond=None)[0])
