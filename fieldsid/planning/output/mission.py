"""Mission snippets: a leg's commands and abort conditions, rendered by the templates of `templates/plan/mission`.

A MOOS helm compares a variable with a number, and not with its value at the start: a heading limit needs the compass course of
the leg. Where that is not stated the script waits until the operator confirms that the heading is watched. The area is a polygon.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined, TemplateError

from fieldsid._version import __version__
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.planning.design.leg import CIRCLE, Abort, Leg, aborts_of, commands_of
from fieldsid.planning.design.plan import Plan
from fieldsid.planning.safety.envelope import NOT_LIMITED, Envelope, limits_said
from fieldsid.registry import near
from fieldsid.templates import template_names, template_path
from fieldsid.text.one_line import one_line

PUBLISHED = {"surge_m_s": "NAV_SPEED", "depth_m": "NAV_DEPTH", "pitch_rad": "NAV_PITCH", "roll_rad": "NAV_ROLL"}
ANY = 1e6
"""Larger than any value: a comparison with it holds as soon as the variable is published."""
SPARE_M = 50.0
"""Length of the polygon before and beyond a leg that is limited to the sides only."""


@dataclass(frozen=True, slots=True)
class Band:
    """The condition under which a heading is watched, empty for always, and the condition that it is outside its limits."""

    when: str
    outside: str


@dataclass(frozen=True, slots=True)
class Polygon:
    """The corners of the area in the syntax of a helm, and the origin and axes of their coordinates in words."""

    points: str
    says: str


def headings(leg: Leg, aborts: tuple[Abort, ...], course: float | None) -> tuple[Band, ...]:
    """Return the bands of heading (deg) of outward and return passes; none without a course or for a limit beyond half a turn."""
    limit = _limit(aborts, "yaw_rad", "deviation")
    if limit is None or limit >= math.pi or course is None:
        return ()
    outward, back = (_outside(course + turn, limit) for turn in (0.0, math.pi))
    if leg.passes == 1:
        return (Band("", outward),)
    return (Band("FIELDSID_RETURN = false", outward), Band("FIELDSID_RETURN = true", back))


def needed(leg: Leg, aborts: tuple[Abort, ...], course: float | None) -> tuple[str, ...]:
    """Return the conditions for the start of a script: every variable that is watched is published."""
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
    """Return the area from the start of the run-up, rotated to the course where that is stated; None without a limit."""
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


FOLDER = "plan/mission"
SUFFIX = ".j2"


@dataclass(frozen=True, slots=True)
class Step:
    """The command from `time` s on: the fin about trim in rad, or the autopilot; and that of each of several fins."""

    time: float
    fin: float
    autopilot: bool
    fins: tuple[float, ...] = ()

    @property
    def degrees(self) -> float:
        """The fin in degrees."""
        return math.degrees(self.fin)


def styles() -> tuple[str, ...]:
    """Return the file names of missions, such as `moos_timer_script.moos`: one per template."""
    return tuple(Path(n).name.removesuffix(SUFFIX) for n in template_names() if n.startswith(f"{FOLDER}/") and n.endswith(SUFFIX))


def steps_of(plan: Plan, leg: Leg) -> tuple[Step, ...]:
    """Return the changes of a leg's command, which is within the limits whatever the plan contains."""
    time, fin, steered = commands_of(leg, plan.envelope)
    fin = np.where(steered > 0, 0.0, fin)
    changed = (np.diff(fin, prepend=np.nan) != 0) | (np.diff(steered, prepend=np.nan) != 0)
    each = np.zeros((0, int(changed.sum()))) if plan.fins is None else plan.fins.fin_commands(fin[changed])
    return tuple(
        Step(round(float(t), 4), round(float(f), 6), bool(s), tuple(np.round(fins, 6).tolist()))
        for t, f, s, fins in zip(time[changed], fin[changed], steered[changed], each.T, strict=True)
    )


def render(plan: Plan, leg: Leg, style: str) -> str:
    """Return one leg as text in a style.

    Raises UsageError for an unknown style or a leg that cannot be flown from a list, ArtifactError for a broken template.
    """
    refuse_blind(plan, leg)
    if style not in styles():
        raise UsageError(f"there is no mission style {style!r}", found=", ".join(styles()) or "none", hint=near(style, styles()))
    try:
        text: str = _environment().get_template(style + SUFFIX).render(_context(plan, leg))
    except TemplateError as error:
        place = f"line {getattr(error, 'lineno', '?')}: {error}"
        what = f"the template `{FOLDER}/{style}{SUFFIX}` is broken"
        raise ArtifactError(what, found=place, hint="compare it with the one that was shipped") from error
    return text.rstrip() + "\n"


def refuse_blind(plan: Plan, leg: Leg) -> None:
    """Raise UsageError for a leg whose rule, replayed as a list of expected fin angles, has too large a risk."""
    if leg.flown_from_list_in(plan.envelope):
        return
    raise UsageError(
        f"`{leg.candidate.maneuver}` at {leg.speed:g} m/s follows the motion: no list of fins can be sent in its place",
        found=f"its expected fins, flown blind, leave the envelope {leg.replay_risk:.0%} of the time, accepted is "
        f"{plan.envelope.share:.0%}",
        hint=instead(leg),
    )


def instead(leg: Leg) -> str:
    """Return the hint for a leg that cannot be flown as a list of fins; a circle has no open-loop alternative."""
    rule = "fly it by the vehicle's own rule"
    return rule if leg.purpose == CIRCLE else f"{rule}, or plan with `--open-loop`"


@cache
def _environment() -> Environment:
    loader = FileSystemLoader(template_path(FOLDER))
    # The output is configuration and code of vehicles, never HTML.
    return Environment(loader=loader, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, autoescape=False)  # noqa: S701


def _context(plan: Plan, leg: Leg) -> dict[str, Any]:
    names, aborts = NAMES[plan.axis], aborts_of(leg, plan.envelope)
    return {
        "tool": f"fieldsid {__version__}",
        "leg": leg,
        "axis": plan.axis.value,
        "fin": names.fin.removesuffix("_rad"),
        "angle": names.angle,
        "vehicle": one_line(plan.vehicle)[:80],
        "rule": None if leg.open_loop else _replay_remark(leg),
        "spec": leg.candidate.spec,
        "steps": steps_of(plan, leg),
        "fins": _fins(plan),
        "turns": _turns(plan, leg),
        "aborts": aborts,
        "limits": _limits(plan, leg),
        "unlimited": [n for n, words in limits_said(leg.envelope_in(plan.envelope)).items() if words == NOT_LIMITED],
        "degrees": math.degrees,
        "limit_of": {f"{a.signal}.{a.kind}": a.limit for a in aborts},
        "headings": headings(leg, aborts, plan.course),
        "needed": needed(leg, aborts, plan.course),
        "polygon": polygon(leg, aborts, plan.course),
    }


def _limits(plan: Plan, leg: Leg) -> Envelope:
    """Return the limits of a leg, with the fin limit that the allocation over several fins allows."""
    limits = leg.envelope_in(plan.envelope)
    return limits if plan.fins is None else replace(limits, fin=min(limits.fin, plan.fins.reach))


def _fins(plan: Plan) -> list[dict[str, Any]]:
    """Return name, share of the command, limit and unit of each of several fins; empty for a single fin."""
    if plan.fins is None:
        return []
    rows = zip(plan.fins.names, plan.fins.shares, plan.fins.limits, strict=True)
    return [{"name": name, "share": share, "limit": limit, "unit": plan.fins.unit} for name, share, limit in rows]


def _turns(plan: Plan, leg: Leg) -> str:
    """Return in words to which side a positive fin turns the vehicle, by the prior of the plan."""
    names = NAMES[plan.axis]
    sign = leg.expected[names.authority].value if names.authority in leg.expected else math.nan
    sides = {Axis.YAW: ("to starboard", "to port"), Axis.PITCH: ("nose up", "nose down")}[plan.axis]
    fin = names.fin.removesuffix("_rad")
    return (
        f"a positive {fin} turns {sides[0] if sign > 0 else sides[1]}"
        if math.isfinite(sign)
        else f"the {fin}'s sign is the logs'"
    )


def _replay_remark(leg: Leg) -> str:
    """Return the remark that the commands of a rule are the expected ones, flown open loop."""
    return (
        f"The maneuver is a rule, {leg.candidate.record.says}: these are the fins it is expected to ask for, flown blind; "
        f"{leg.replay_risk:.1%} of the vehicles that are thought possible leave the limits so."
    )
