"""A schedule: gains per speed with their margins, what they refer to and where they came from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import degrees, inf, isfinite
from typing import TYPE_CHECKING, Any

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, facts
from fieldsid.records.keys import body_of
from fieldsid.rounding import RADIANS, Angles, number
from fieldsid.views._words import table

if TYPE_CHECKING:
    from fieldsid.schedule.record import Schedule

SLOWED_SHARE = 0.995
"""Below it a row's share is not printed as 1.00."""


def line(schedule: Schedule) -> str:
    """Return the range of the gain kp over speed, the controller, and the least phase margin."""
    rows = schedule.rows
    kp = " to ".join(f"{number(r.gains.kp, 3)} at {number(r.speed, 3)} m/s" for r in dict.fromkeys((rows[0], rows[-1])))
    least = min((r.phase_margin_deg for r in rows if isfinite(r.phase_margin_deg)), default=inf)
    margin = f"least phase margin {least:.0f} deg" if isfinite(least) else "no loop crosses unity"
    return f"kp {kp}, {schedule.kind}; {margin}"


def page(schedule: Schedule) -> Page:
    """Return the main result, the fins, what the gains were asked for, and a row of gains for each speed."""
    asked = (("asked for", f"damping {number(schedule.damping, 3)}, phase margin {number(schedule.phase_margin_deg, 3)} deg"),)
    known = facts("", (("fins", "; ".join(schedule.fins_said)), *asked))
    return Page(f"Schedule of the {schedule.axis.value} axis: {line(schedule)}", (), (known, *blocks_of(schedule)))


def blocks_of(schedule: Schedule, angles: Angles = RADIANS, neglected: Iterable[str] = ()) -> Iterator[Block | str]:
    """Yield the gains of each speed, and the assumptions of the design; `neglected` names what of the models is left out."""
    from fieldsid.schedule.verdict import fin_of
    from fieldsid.schedule.verify import steps_of

    rows = tuple(
        (
            number(r.speed, 3),
            number(r.gains.kp),
            *(number(v, 3) for v in (r.gains.ki, r.gains.kd, *((r.depth_gain,) if schedule.depth else ()))),
            f"{r.phase_margin_deg:.0f}",
            f"{r.settling:.1f}" if isfinite(r.settling) else "never",
            "yes" if r.supported else "no",
            f"{r.draws_held:.0%}",
            *(number(angles.factor * v, 3) for v in (r.feed_forward, r.fin_limit)),
            f"{r.fin_use:.0%}",
        )
        for r in schedule.rows
    )
    depth, known = ("kz",) if schedule.depth else (), schedule.provenance
    heads = ("m/s", "kp", "ki", "kd", *depth, "phase", "settle s", "data", "held", "forward", "fin", "asks")
    title = f"{schedule.axis.value}, {schedule.kind}: gains per speed, forward and fin in {angles.unit}"
    yield Block(title, rows, heads, left=0)
    yield f"in the file: {known['sign_convention']}" if "sign_convention" in known else ""
    yield f"counted with: {'; '.join((fin_of(schedule.actuator), *(str(v) for v in [known.get('speed_lost')] if v), *neglected))}"
    for binds in dict.fromkeys(r.binds for r in schedule.rows):
        yield f"bound by {binds}: {', '.join(number(r.speed, 3) for r in schedule.rows if r.binds == binds)} m/s"
    if "draws" in known:
        worst = f"the worst of 95 % of {known['draws']} draws of {known.get('draws_of', 'the models')}"
        step = f"{degrees(steps_of(schedule)[1]):.0f} deg step"
        yield f"asks: of the fin by a {step}; phase, settle: {worst}; held: those that come to rest from that step"
    if rejected := known.get("draws_rejected"):
        yield f"up to {100 * rejected:.0f} % of the draws were rejected as outside what is physical, and drawn anew"
    if slowed := sum(r.slowed < SLOWED_SHARE for r in schedule.rows):
        yield f"{slowed} of {len(schedule.rows)} rows were slowed for lag, delay, margin or the draws (1 is the formula's)"


def frames(schedule: Schedule) -> Frames:
    """Return a row of gains for each speed."""
    return {"rows": lambda: table((body_of(r) for r in schedule.rows), "speed_m_s")}


def system(schedule: Schedule, speed: float | None) -> Any:
    """Return the controller at a speed, without one those of the rows by speed."""
    from fieldsid.views._control import controller_system

    if speed is None:
        return {row.speed: controller_system(row, schedule.axis) for row in schedule.rows}
    return controller_system(schedule.at(speed), schedule.axis)


def figures(schedule: Schedule) -> Figures:
    """Return gains, feed-forward and phase margin over speed."""
    return {"gains": sketch("schedule", schedule, draw="gains_figure")}


VIEW = View("schedule", line, page, frames, lambda schedule: schedule.axis.value, figures, system=system)
