"""The unit of numbers that nothing states: by their size, by the jump where a heading wraps, by signals that agree with them.

An angle whose numbers go beyond a turn in rad, or jump by a turn where they wrap, tells its unit itself; a fin's are counts where
they are whole and lie about the middle of a servo's. A rate agrees with the change of its angle, a speed with the way made by x
and y and with the change of the depth, a heading with the course. What none of these tells is assumed to be SI.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldsid.logs.channels import POSITION
from fieldsid.logs.convert.servo_counts import COUNTED, COUNTS, FULL_RAD, Servo, servo_of
from fieldsid.logs.convert.units import DEGREE, UNITS, pick_unit
from fieldsid.logs.doctor.angle_and_rate import PAIRS, agrees_with_rate
from fieldsid.logs.doctor.pair_findings import goes_along_course, goes_with_depth, goes_with_way
from fieldsid.logs.doctor.signal_findings import LARGEST
from fieldsid.logs.run import FINS, GOALS, MOTORS, SIGNALS, Note, Run
from fieldsid.numerics.arrays import FloatArray

LARGEST_DEG = 180.0
"""A fin whose numbers are larger is in no unit of an angle."""
WRAPPING = ("rad", "deg", "gon", "ddeg", "cdeg")
"""Units in which headings are logged from nil to a turn; the first two where few numbers are beyond a turn in degrees."""
OF_A_TURN = 0.9
"""Share of a turn by which a heading jumps at least where it wraps: a vehicle does not turn by a tenth between two samples."""
TO_A_TURN = 1.01
"""Turns that a heading which wraps spans at most: one, and what its last digit is rounded up by."""
TURN = TO_A_TURN * math.tau
"""A heading whose numbers are larger is not within a turn in rad."""
OFTEN = 0.05
"""Share of the samples that must be beyond a turn in degrees: fewer may be damage."""
MOST_TURNS = 10.0
"""Turns that a heading of a log of maneuvers may count on."""


@dataclass(frozen=True, slots=True)
class Reading:
    """How a mapping reads a fin's numbers, the rad that one is worth, and what they are at zero."""

    item: Mapping[str, Any]
    worth: float = 1.0
    centre: float = 0.0


def as_counts(servo: Servo) -> Reading:
    """Return how the counts of a servo are read."""
    return Reading({"unit": COUNTS, "centre": round(servo.centre)}, FULL_RAD / servo.travel, servo.centre)


def fin_reading(values: FloatArray) -> Reading | None:
    """Return how the numbers (n,) of a fin are read: counts, degrees where they are too large for rad; None where for both."""
    servo, largest = servo_of(values), float(np.nanmax(np.abs(values)))
    if servo is not None:
        return as_counts(servo)
    if largest > LARGEST_DEG:
        return None
    return Reading({"unit": "deg"}, DEGREE) if largest > LARGEST["rudder_rad"][0] else Reading({"unit": "rad"})


def in_radians(values: FloatArray, unit: str | None = None) -> FloatArray:
    """Return an angle (n,) in rad: by its unit, without one by its size."""
    told = unit or ("deg" if float(np.nanmax(np.abs(values), initial=0.0)) > TURN else "rad")
    return values * pick_unit(told).factor


def unit_of_wraps(values: FloatArray) -> str | None:
    """Return the unit in which a heading (n,) jumps by nearly a turn where it wraps; None where it does in none."""
    seen = values[np.isfinite(values)] if values.ndim == 1 else values[:0, 0]
    if seen.size < 2:
        return None
    jump, span = float(np.abs(np.diff(seen)).max()), float(np.ptp(seen))
    units = WRAPPING if float((np.abs(seen) > 360.0).mean()) >= OFTEN else WRAPPING[:2]
    turns = {unit: 2.0 * math.pi / UNITS[unit].factor for unit in units}
    return next((u for u, turn in turns.items() if OF_A_TURN * turn <= jump <= span <= TO_A_TURN * turn), None)


def set_by_size(signals: Mapping[str, Any], values: Mapping[str, FloatArray], stated: Mapping[str, str]) -> frozenset[str]:
    """Set in the lines of signals what the size of their numbers (n,) says; return those whose angles are too large for rad.

    Pitch, roll and goals without a unit are in degrees too where the heading is: one logger wrote them. `stated` are units that
    are known without a line.
    """
    seen = {s: v[np.isfinite(v)] for s, v in values.items() if "unit" not in signals[s] and s not in stated}
    seen = {s: v for s, v in seen.items() if v.size}
    for signal, servo in _servos({s: v for s, v in seen.items() if s in COUNTED}).items():
        signals[signal].update(as_counts(servo).item)
        del seen[signal]
    units = {s: unit for s, v in seen.items() if (unit := _unit_by_size(s, v)) is not None}
    of_heading = {known.get("yaw_rad") for known in (units, stated)} | {signals.get("yaw_rad", {}).get("unit")}
    beside = ("pitch_rad", "roll_rad", *sorted(GOALS)) if "deg" in of_heading else ()
    for signal, unit in {**{s: "deg" for s in beside if s in seen and "field" not in signals[s]}, **units}.items():
        signals[signal]["unit"] = unit
    return frozenset(units)


def _unit_by_size(signal: str, values: FloatArray) -> str | None:
    """Return the unit of an angle or a rate whose numbers (n,) are too large for rad: degrees unless a heading's wraps differ."""
    limit, unit = (TURN, "deg") if signal in ("yaw_rad", "yaw_goal_rad") else LARGEST.get(signal, (np.inf, ""))
    if not (float(np.abs(values).max()) > limit and unit.startswith("deg")):
        return None
    return unit_of_wraps(values) or unit if signal == "yaw_rad" else unit


def _servos(seen: Mapping[str, FloatArray]) -> dict[str, Servo]:
    """Return the kinds of counts in which fins and motors (n,) are logged, of those that are in counts.

    One that never moves far tells no kind itself, and is in that of the fins where its numbers fit it.
    """
    kinds = {s: servo_of(v) for s, v in seen.items()}
    of_fins = [k for s, k in kinds.items() if s in FINS and k is not None]
    for signal, v in seen.items():
        if kinds[signal] is None and bool((v == np.round(v)).all()):
            kinds[signal] = next((k for k in of_fins if k.least <= v.min() and v.max() <= k.largest), None)
    return {s: k for s, k in kinds.items() if k is not None}


def heading_in_doubt(values: FloatArray, signals: Mapping[str, Any]) -> list[Note]:
    """Say of a heading (n,) taken for degrees by its size what else it may be, where no rate and no position tells."""
    unit = signals["yaw_rad"].get("unit")
    if {"yaw_rate_rad_s", "x_m", POSITION} & signals.keys():
        return []
    if unit != "deg":
        message = f"yaw_rad wraps by nearly {2.0 * np.pi / UNITS[unit].factor:.0f}, one turn in {unit}"
        return [Note("evidence", message, {"signal": "yaw_rad", "unit": unit})]
    seen = np.abs(values[np.isfinite(values)])
    largest = float(seen.max())
    in_degrees, in_radians, data = largest / 360.0, largest / (2.0 * np.pi), {"signal": "yaw_rad", "largest": largest}
    if in_degrees > MOST_TURNS and float((seen > 360.0 * MOST_TURNS).mean()) >= OFTEN:
        message = (
            f"yaw_rad is taken for degrees and reaches {largest:.5g}, {in_degrees:.0f} turns (limit {MOST_TURNS:.0f}): is it in "
            "another unit, as `unit: cdeg` or `unit: ddeg`?"
        )
        return [Note("unit", message, data)]
    said = (
        f"yaw_rad is taken for degrees because it reaches {largest:.3g}; in radians that would be {in_radians:.1f} turns, "
        "and nothing in the log says which: set `unit: rad` if it counts turns"
    )
    return [Note("unit", said, data)] if in_radians <= MOST_TURNS else []


def assumed_units(run: Run, known: Collection[str], places: Mapping[str, tuple[str, str]]) -> list[Note]:
    """Return the note on the signals of a run, by their places and units, that are taken so though nothing says it.

    `known` have a unit that is told.
    """
    sure = {s for s in run.signals if s in known}
    if goes_with_way(run):
        sure |= {"x_m", "y_m", "surge_m_s"}
    if goes_along_course(run):
        sure.add("yaw_rad")
    agreeing = [{a, r} for a, r in PAIRS if agrees_with_rate(run, a, r)]
    if goes_with_depth(run):
        agreeing += [{"depth_m", "surge_m_s"}]
    sure |= {s for both in agreeing if both & sure for s in both}
    assumed = [s for s in run.signals if s in SIGNALS and run.has(s) and s not in sure and s not in MOTORS]
    shown = ", ".join(f"{s} from `{place}` in {unit}" for s in assumed for place, unit in [places.get(s, ("", SIGNALS[s]))])
    message = f"no name and no other signal tells the unit of what is taken as it is: {shown}; write `unit:` where it is another"
    return [Note("unit_assumed", message, {"signals": assumed})] if assumed else []
