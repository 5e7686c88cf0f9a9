"""The inference of units that are not stated: from the size of numbers, the jump where a heading wraps, and other signals.

The unit of an angle follows from numbers beyond 2 pi, or from a jump of a turn where they wrap. The numbers of a fin are counts
where they are integers about the centre of a servo. A rate must agree with the change of its angle, a speed with the distance by
x and y and with the change of depth, a heading with the course. A unit that none of these shows is assumed to be SI.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldsid.logs.channels import POSITION
from fieldsid.logs.convert.servo_counts import COUNTED, COUNTS, FULL_RAD, Servo, servo_of
from fieldsid.logs.convert.units import CLEARLY, DEGREE, UNITS, pick_unit
from fieldsid.logs.doctor.angle_and_rate import agrees_with_rate
from fieldsid.logs.doctor.pair_findings import goes_along_course, goes_with_depth, goes_with_way
from fieldsid.logs.doctor.signal_findings import LARGEST
from fieldsid.logs.few_of import FEW
from fieldsid.logs.run import FINS, GOALS, MOTORS, RATE_OF, SIGNALS, Note, Run
from fieldsid.numerics.arrays import FloatArray

LARGEST_DEG = 180.0
"""Largest number of a fin in a unit of angle."""
WRAPPING = ("rad", "deg", "gon", "ddeg", "cdeg")
"""Units of headings from zero to a turn; only the first two are tried where few numbers exceed 360."""
OF_A_TURN = 0.9
"""Smallest jump of a wrapping heading, in turns: a vehicle does not turn by a tenth of a turn between two samples."""
TO_A_TURN = 1.01
"""Largest span of a wrapping heading, in turns: one, plus the rounding of the last digit."""
TURN = TO_A_TURN * math.tau
"""Largest number of a wrapped heading in rad."""
MOST_TURNS = 10.0
"""Largest number of turns that an unwrapped heading in a log of maneuvers counts."""


@dataclass(frozen=True, slots=True)
class Reading:
    """The conversion of a fin's numbers: keys of a mapping, angle in rad of one unit, and number at zero angle."""

    item: Mapping[str, Any]
    worth: float = 1.0
    centre: float = 0.0


def as_counts(servo: Servo) -> Reading:
    """Return the conversion of the counts of a servo."""
    return Reading({"unit": COUNTS, "centre": round(servo.centre)}, FULL_RAD / servo.travel, servo.centre)


def fin_reading(values: FloatArray) -> Reading | None:
    """Return the conversion of the numbers (n,) of a fin: counts, rad, or degrees where too large for rad; None beyond all."""
    servo, largest = servo_of(values), float(np.nanmax(np.abs(values)))
    if servo is not None:
        return as_counts(servo)
    if largest > LARGEST_DEG:
        return None
    return Reading({"unit": "deg"}, DEGREE) if largest > LARGEST["rudder_rad"][0] else Reading({})


def in_radians(values: FloatArray, unit: str | None = None) -> FloatArray:
    """Return an angle (n,) in rad, converted from its unit, or without one from the unit that its size shows."""
    unit_used = unit or ("deg" if float(np.nanmax(np.abs(values), initial=0.0)) > TURN else "rad")
    return values * pick_unit(unit_used).factor


def unit_of_wraps(values: FloatArray) -> str | None:
    """Return the unit in which a heading (n,) jumps by nearly a turn where it wraps; None without one."""
    seen = values[np.isfinite(values)] if values.ndim == 1 else values[:0, 0]
    if seen.size < 2:
        return None
    jump, span = float(np.abs(np.diff(seen)).max()), float(np.ptp(seen))
    units = WRAPPING if float((np.abs(seen) > 360.0).mean()) >= FEW else WRAPPING[:2]
    turns = {unit: 2.0 * math.pi / UNITS[unit].factor for unit in units}
    return next((u for u, turn in turns.items() if OF_A_TURN * turn <= jump <= span <= TO_A_TURN * turn), None)


def set_by_size(signals: Mapping[str, Any], values: Mapping[str, FloatArray], stated: Mapping[str, str]) -> frozenset[str]:
    """Set the units that the size of the numbers (n,) shows in the lines of signals; return the angles too large for rad.

    Where the heading is in degrees, pitch, roll and setpoints without a unit are so too, since one logger wrote them. `stated`
    holds units that the log itself states.
    """
    seen = {s: v[np.isfinite(v)] for s, v in values.items() if "unit" not in signals[s] and s not in stated}
    seen = {s: v for s, v in seen.items() if v.size}
    for signal, servo in _servos({s: v for s, v in seen.items() if s in COUNTED}).items():
        signals[signal].update(as_counts(servo).item)
        del seen[signal]
    units = {s: unit for s, v in seen.items() if (unit := _unit_by_size(s, v)) is not None}
    of_heading = {known.get("yaw_rad") for known in (units, stated)} | {signals.get("yaw_rad", {}).get("unit")}
    in_heading_unit = dict.fromkeys(("pitch_rad", "roll_rad", *sorted(GOALS)), "deg") if "deg" in of_heading else {}
    if "yaw_goal_rad" in seen and "yaw_rad" in values and _is_goal_in_rad(values["yaw_goal_rad"], values["yaw_rad"] * DEGREE):
        in_heading_unit |= {"yaw_goal_rad": "rad"} if in_heading_unit else {}
    own = {s: unit for s, unit in in_heading_unit.items() if s in seen and "field" not in signals[s]}
    for signal, unit in {**own, **units}.items():
        signals[signal]["unit"] = unit
    return frozenset(units)


def _is_goal_in_rad(goal: FloatArray, heading: FloatArray) -> bool:
    """Return whether a heading in rad (n,) follows a setpoint (n,) that is read in rad, or this one wraps as one in rad does."""
    if unit_of_wraps(goal) is not None or goal.shape != heading.shape:
        return unit_of_wraps(goal) == "rad"
    off_by_rad, off_by_deg = (1.0 - float(np.nanmean(np.cos(heading - goal * factor))) for factor in (1.0, DEGREE))
    return off_by_rad < off_by_deg / CLEARLY


def _unit_by_size(signal: str, values: FloatArray) -> str | None:
    """Return the unit of an angle or rate whose numbers (n,) are too large for rad: degrees, or that of a heading's wraps."""
    limit, unit = (TURN, "deg") if signal in ("yaw_rad", "yaw_goal_rad") else LARGEST.get(signal, (np.inf, ""))
    if not (float(np.abs(values).max()) > limit and unit.startswith("deg")):
        return None
    return unit_of_wraps(values) or unit if signal == "yaw_rad" else unit


def _servos(seen: Mapping[str, FloatArray]) -> dict[str, Servo]:
    """Return the kind of counts of each fin or motor (n,) that is logged in counts.

    A signal that hardly moves does not show its kind; it is assigned that of the fins where its numbers fit.
    """
    kinds = {s: servo_of(v) for s, v in seen.items()}
    of_fins = [k for s, k in kinds.items() if s in FINS and k is not None]
    for signal, v in seen.items():
        if kinds[signal] is None and bool((v == np.round(v)).all()):
            kinds[signal] = next((k for k in of_fins if k.least <= v.min() and v.max() <= k.largest), None)
    return {s: k for s, k in kinds.items() if k is not None}


def heading_in_doubt(values: FloatArray, signals: Mapping[str, Any]) -> list[Note]:
    """Return the note on the doubt about a heading (n,) that is read in degrees by its size alone."""
    unit = signals["yaw_rad"].get("unit")
    if {"yaw_rate_rad_s", "x_m", POSITION} & signals.keys():
        return []
    if unit != "deg":
        message = f"yaw_rad wraps by nearly {2.0 * np.pi / UNITS[unit].factor:.0f}, one turn in {unit}"
        return [Note("evidence", message, {"signal": "yaw_rad", "unit": unit})]
    seen = np.abs(values[np.isfinite(values)])
    largest = float(seen.max())
    in_degrees, in_radians, data = largest / 360.0, largest / (2.0 * np.pi), {"signal": "yaw_rad", "largest": largest}
    if in_degrees > MOST_TURNS and float((seen > 360.0 * MOST_TURNS).mean()) >= FEW:
        message = (
            f"yaw_rad is taken for degrees and reaches {largest:.5g}, {in_degrees:.0f} turns (limit {MOST_TURNS:.0f}): is it in "
            "another unit, as `unit: cdeg` or `unit: ddeg`?"
        )
        return [Note("unit", message, data)]
    message_text = (
        f"yaw_rad is taken for degrees because it reaches {largest:.3g}; in radians that would be {in_radians:.1f} turns, "
        "and nothing in the log says which: set `unit: rad` if it counts turns"
    )
    return [Note("unit", message_text, data)] if in_radians <= MOST_TURNS else []


def assumed_units(run: Run, known: Collection[str], places: Mapping[str, tuple[str, str]]) -> list[Note]:
    """Return the note on the signals of a run whose units are assumed; `places` holds the source and unit of each.

    `known` are the signals with a known unit.
    """
    sure = {s for s in run.signals if s in known}
    if goes_with_way(run):
        sure |= {"x_m", "y_m", "surge_m_s"}
    if goes_along_course(run):
        sure.add("yaw_rad")
    agreeing = [{a, r} for a, r in RATE_OF.items() if agrees_with_rate(run, a, r)]
    if goes_with_depth(run):
        agreeing += [{"depth_m", "surge_m_s"}]
    sure |= {s for both in agreeing if both & sure for s in both}
    assumed = [s for s in run.signals if s in SIGNALS and run.has(s) and s not in sure and s not in MOTORS]
    shown = ", ".join(f"{s} from `{place}` in {unit}" for s in assumed for place, unit in [places.get(s, ("", SIGNALS[s]))])
    message = f"no name and no other signal tells the unit of what is taken as it is: {shown}; write `unit:` where it is another"
    return [Note("unit_assumed", message, {"signals": assumed})] if assumed else []
