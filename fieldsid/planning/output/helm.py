"""A leg's limits in the terms of a MOOS helm: logic conditions on its NAV variables, and the polygon of the area.

A helm compares a variable with a number and knows no deviation from a start: the heading needs the leg's compass course,
and where that is not known the script waits until somebody says that the heading is watched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fieldsid.planning.design.leg import Abort, Leg

PUBLISHED = {"surge_m_s": "NAV_SPEED", "depth_m": "NAV_DEPTH", "pitch_rad": "NAV_PITCH", "roll_rad": "NAV_ROLL"}
ANY = 1e6
"""Larger than any value: a condition that holds once a variable is published at all."""
SPARE_M = 50.0
"""Length before and beyond a leg of a polygon that stands for a limit to the sides alone."""


@dataclass(frozen=True, slots=True)
class Band:
    """When a heading is watched, empty for always, and the condition that it is outside."""

    when: str
    outside: str


@dataclass(frozen=True, slots=True)
class Polygon:
    """The corners of the area as a helm takes them, and from where they are."""

    points: str
    says: str


def headings(leg: Leg, aborts: tuple[Abort, ...], course: float | None) -> tuple[Band, ...]:
    """Return the bands of heading (deg) to be watched, there and back; none without a course, or beyond half a turn."""
    limit = _limit(aborts, "yaw_rad", "deviation")
    if limit is None or limit >= math.pi or course is None:
        return ()
    there, back = (_outside(course + turn, limit) for turn in (0.0, math.pi))
    if leg.passes == 1:
        return (Band("", there),)
    return (Band("FIELDSID_RETURN = false", there), Band("FIELDSID_RETURN = true", back))


def needed(leg: Leg, aborts: tuple[Abort, ...], course: float | None) -> tuple[str, ...]:
    """Return the conditions without which a script must not start: everything that is watched is there."""
    found = [f"{PUBLISHED[s]} >= -{ANY:.0f}" for s in dict.fromkeys(a.signal for a in aborts) if s in PUBLISHED]
    if any(a.signal in ("x_m", "y_m") for a in aborts):
        found += [f"NAV_X >= -{ANY:.0f}", f"NAV_Y >= -{ANY:.0f}"]
    if headings(leg, aborts, course):
        found.append(f"NAV_HEADING >= -{ANY:.0f}")
        if leg.passes > 1:
            found.append("(FIELDSID_RETURN = true) or (FIELDSID_RETURN = false)")
    elif _limit(aborts, "yaw_rad", "deviation") is not None:
        found.append("FIELDSID_HEADING_WATCHED = true")
    return tuple(found)


def polygon(leg: Leg, aborts: tuple[Abort, ...], course: float | None) -> Polygon | None:
    """Return the area from the start of the run-up on, turned to the course where that is known; None where there is none."""
    side = _limit(aborts, "y_m", "deviation")
    if side is None:
        return None
    run_up = leg.run_up_s * leg.speed
    far, near = _limit(aborts, "x_m", "above"), _limit(aborts, "x_m", "below")
    end = far + run_up if far is not None else run_up + leg.window.length * leg.speed + SPARE_M
    start = near + run_up if near is not None else -SPARE_M
    corners = [(start, -side), (end, -side), (end, side), (start, side)]
    if course is None:
        says = "x along the leg from the start of its run-up, y to starboard: turn and shift it to the leg's line"
    else:
        corners = [_turned(a, s, course) for a, s in corners]
        says = "x east and y north of the start of the run-up: shift it there"
    return Polygon(" : ".join(f"{x:.1f},{y:.1f}" for x, y in corners), says)


def _turned(along: float, side: float, course: float) -> tuple[float, float]:
    """Return east and north of a point along a course (rad) and to starboard of it."""
    sin, cos = math.sin(course), math.cos(course)
    return along * sin + side * cos, along * cos - side * sin


def _outside(course: float, limit: float) -> str:
    low, high = (math.degrees(course + by) % 360.0 for by in (-limit, limit))
    word = "or" if low < high else "and"
    return f"(NAV_HEADING < {low:.2f}) {word} (NAV_HEADING > {high:.2f})"


def _limit(aborts: tuple[Abort, ...], signal: str, kind: str) -> float | None:
    return next((a.limit for a in aborts if (a.signal, a.kind) == (signal, kind)), None)
