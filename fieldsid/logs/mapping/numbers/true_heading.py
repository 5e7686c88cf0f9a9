"""The choice of the vehicle's heading among several columns, of which some are courses, and the direction from which it counts.

In a turn the heading psi is ahead of the course chi by the sideslip, which is proportional to the yaw rate r (Fossen 2021,
section 6.5). The lead time T in psi - chi = T r + current is zero or negative for a course, whose receiver is late, and clearly
positive for a compass. Where a yaw rate is logged, the heading is the angle that agrees with its integral.

Heading, x and y from north and clockwise, and all three from east and counterclockwise, are mirror images of each other, which
their numbers cannot distinguish. A latitude and longitude can, and so can a course over ground or velocities north and east.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldsid.logs.convert.frames import north_and_east
from fieldsid.logs.convert.units import CLEARLY
from fieldsid.logs.doctor.angle_and_rate import PAIR_WINDOW_S, STRONG, changes_of
from fieldsid.logs.doctor.pair_findings import TURNED, WINDOW_S, course_of
from fieldsid.logs.doctor.together import SURE, agreement, change, width_of
from fieldsid.logs.mapping.canonical_names import unit_in_name, words_of
from fieldsid.logs.mapping.numbers.unit_inference import in_radians
from fieldsid.logs.mapping.vocabulary import COMMANDED, COMPASS, LATITUDE, LONGITUDE, OF_ANOTHER, OVER_GROUND
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import Samples
from fieldsid.logs.run import ANGLES_AND_RATES, Note, Run
from fieldsid.numerics.arrays import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True)
class Lead:
    """The time in s by which an angle leads the course, and its standard error."""

    seconds: float
    error: float

    @property
    def is_clear(self) -> bool:
        """Return whether the angle leads the course significantly, as a heading does."""
        return self.seconds > SURE * self.error


def better_heading(runs: Sequence[Run], names: Sequence[str]) -> tuple[int, Note] | None:
    """Return the index of the heading that replaces the first of several, and the reason; None where the first is kept."""
    misfits = [_rate_misfit(run) for run in runs]
    best = min(range(len(runs)), key=lambda i: misfits[i])
    if np.isfinite(misfits[0]) and best != 0 and misfits[0] > CLEARLY * misfits[best]:
        why = f"the logged rate makes it within {misfits[best]:.2g} rad, the other within {misfits[0]:.2g} rad"
        return best, _taken(names, best, why)
    other = lead_of(runs[0])
    if np.isfinite(misfits[0]) or other is None or other.is_clear:
        return None
    clear_leads = {i: lead for i, run in enumerate(runs) if (lead := lead_of(run)) is not None and lead.is_clear}
    if not clear_leads:
        return None
    best, most = max(clear_leads.items(), key=lambda found: found[1].seconds)
    why = (
        f"in turns it is {most.seconds:.2f} +/- {most.error:.2f} s ahead of the course of x_m and y_m, as a hull that slides is; "
        f"the other is that course ({other.seconds:.2f} +/- {other.error:.2f} s)"
    )
    return best, _taken(names, best, why)


def _taken(names: Sequence[str], best: int, why: str) -> Note:
    message = f"yaw_rad is taken from {names[best]} and not from {names[0]}, which is a course over ground: {why}"
    return Note("evidence", message, {"signal": "yaw_rad", "others": [names[0]]})


def _rate_misfit(run: Run) -> float:
    """Return the standard deviation in rad of a heading's changes from the integral of the yaw rate; infinite without a rate."""
    changes = changes_of(run, *ANGLES_AND_RATES[:2])
    return float("inf") if changes is None else float(np.std(changes[0] - changes[1]))


def lead_of(run: Run) -> Lead | None:
    """Return the time by which the heading of a run leads its course; None where the log does not show it."""
    made = course_of(run, PAIR_WINDOW_S)  # in a longer window a vehicle may turn more than once
    return None if made is None else _regressed(made.heading - made.course, made.heading, made.rate, made.width)


def _regressed(off: FloatArray, yaw: FloatArray, rate: FloatArray, width: int) -> Lead | None:
    """Return T from the regression of psi - chi (n,) on the rate, an offset, and the two components of a current."""
    turned = np.exp(1j * off)
    angle = np.angle(turned * np.conj(np.mean(turned)))
    base = np.stack([rate, np.ones_like(rate), np.cos(yaw), np.sin(yaw)], axis=1)
    values, _, rank, _ = np.linalg.lstsq(base, angle, rcond=None)
    if rank < base.shape[1]:
        return None
    left = angle - base @ values
    # overlapping windows are not independent: the variance is larger by `width`
    spread = width * float(left @ left) / max(angle.size - width * base.shape[1], 1)
    covariance = np.linalg.inv(base.T @ base) * spread
    return Lead(float(values[0]), float(np.sqrt(covariance[0, 0])))


NEAR = math.pi / 4
"""Largest deviation in rad from the expected angle between heading and course, for sideslip, current and compass errors."""
ENU = "ENU"
GEOGRAPHIC = frozenset({"north", "northing", "east", "easting", "n", "e", "utm"})
"""Words of a column in metres that state its direction."""


def true_north(samples: Samples, names: Sequence[str], signals: Mapping[str, Any]) -> list[Note]:
    """Set the frame of a heading, and of x and y, that count from east; return notes with the reason, or that it is undecided."""
    place, yaw = _columns_without_frame(samples, signals, "x_m", "y_m"), _columns_without_frame(samples, signals, "yaw_rad")
    directions: dict[tuple[str, ...], ComplexArray] = {("x_m", "y_m"): _displacement(samples, *place)} if place else {}
    directions |= {("yaw_rad",): np.exp(1j * in_radians(yaw[0], signals["yaw_rad"].get("unit")))} if yaw else {}
    notes, settled = list[Note](), set[tuple[str, ...]]()
    for source, travel in _travels(samples, names):
        for turned, direction in directions.items():
            mean, mirrored = agreement(direction, travel)
            along, against = abs(mean), abs(mirrored)
            # counted from east and counterclockwise, x + iy = i (north - i east) is at pi/2 to the mirror image
            off = math.remainder(float(np.angle(mirrored)) - 0.5 * math.pi, math.tau)
            is_open = max(along, against) < STRONG or abs(along - against) < TURNED or (against > along and abs(off) > NEAR)
            if turned not in settled and not is_open:
                settled.add(turned)
                notes += _set_from_east(turned, signals, source, against, along) if against > along else []
    if len(directions) < 2 or ("yaw_rad",) in settled or _is_named(signals):
        return notes
    along, against = map(abs, agreement(*directions.values()))
    return [*notes, _frame_open()] if len(settled) == 0 and along > STRONG and along - against > TURNED else notes


def _set_from_east(turned: tuple[str, ...], signals: Mapping[str, Any], source: str, against: float, along: float) -> list[Note]:
    """Set signals as counted from east, and return a note with the reason."""
    for signal in turned:
        signals[signal]["frame"] = ENU
    message = (
        f"{' and '.join(turned)}: taken with `frame: {ENU}`, counted from east: the way by {source} turns against it (agreement "
        f"{against:.2f} against and {along:.2f} along it, limit {TURNED:g} between them)"
    )
    return [Note("evidence", message, {"signal": turned[0], "value": against - along, "limit": TURNED})]


def _frame_open() -> Note:
    message = (
        "yaw_rad goes with x_m and y_m whether all three count from north, clockwise, or from east, counterclockwise: the log "
        "does not tell port from starboard; a latitude and longitude or a course over ground beside them would, and so does a "
        "turn whose side is known; where it is east set `frame: ENU/FLU` at the top of the mapping"
    )
    return Note("frame_open", message, {"signal": "yaw_rad"})


def _is_named(signals: Mapping[str, Any]) -> bool:
    """Return whether the names of the columns state their directions."""
    words = {s: set(words_of(str(signals[s].get("column")))) for s in ("yaw_rad", "x_m", "y_m")}
    return bool((COMPASS | {"true", "magnetic"}) & words["yaw_rad"] or GEOGRAPHIC & (words["x_m"] | words["y_m"])) or any(
        "frame" in signals[s] for s in words
    )


def _columns_without_frame(samples: Samples, signals: Mapping[str, Any], *wanted: str) -> list[FloatArray]:
    """Return the columns (n,) of some signals; none where one is missing or its frame is known."""
    items = [item for s in wanted if not {"frame", "sign"} & (item := signals.get(s, {})).keys()]
    found = [samples.columns[item["column"]] for item in items if item.get("column") in samples.columns]
    return found if len(found) == len(wanted) else []


def _displacement(samples: Samples, north: FloatArray, east: FloatArray) -> ComplexArray:
    """Return the displacement north + i east (n,) over a window about each sample, NaN at the ends."""
    return change(north + 1j * east, width_of(samples.time, WINDOW_S))


def _travels(samples: Samples, names: Sequence[str]) -> Iterator[tuple[str, ComplexArray]]:
    """Yield, in words, columns whose directions north and east are certain, and the displacement or direction (n,) they give."""
    known = [n for n in names if n in samples.columns and not (COMMANDED | OF_ANOTHER) & set(words_of(n))]
    means = {n: (meaning_of(n) or ("", 0))[0] for n in known}
    latitude, longitude = (next((n for n in known if means[n] == s), None) for s in (LATITUDE, LONGITUDE))
    if latitude is not None and longitude is not None:
        north, east = north_and_east(np.stack([samples.columns[latitude], samples.columns[longitude]], axis=1))
        yield f"`{latitude}` and `{longitude}`", _displacement(samples, north, east)
    fast = [next((n for n in known if _is_speed(n, side)), None) for side in ("n", "e")]
    if fast[0] is not None and fast[1] is not None:
        yield f"`{fast[0]}` and `{fast[1]}`", samples.columns[fast[0]] + 1j * samples.columns[fast[1]]
    for name in known:
        values = samples.columns[name]
        if _is_course(name, means[name], values):
            yield f"the course over ground `{name}`", np.exp(1j * in_radians(values, unit_in_name(name, "yaw_rad")))


def _is_course(name: str, means: str, values: FloatArray) -> bool:
    """Return whether a column is a course over ground, which counts from north: by its name, or as a course without negatives."""
    words = set(words_of(name))
    if "cog" in words or (means == "yaw_rad" and OVER_GROUND & words):
        return True
    return "course" in words and float(np.nanmin(values, initial=np.inf)) >= 0.0


def _is_speed(name: str, side: str) -> bool:
    words = set(words_of(name))
    full_word = {"n": "north", "e": "east"}[side]
    return f"v{side}" in words or (
        bool(words & {"v", "vel", "velocity", "speed"}) and bool(words & {side, full_word, f"{full_word}ing"})
    )
