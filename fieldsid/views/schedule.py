"""A schedule: gains per speed with their margins, what they refer to and where they came from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from fieldsid.display import View
from fieldsid.page import Block, Page, facts, listed
from fieldsid.records.keys import body_of
from fieldsid.rounding import number
from fieldsid.views._words import table

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.schedule import Schedule


def line(schedule: Schedule) -> str:
    """Return axis, controller, the span of speeds and gains, the least phase margin, and the rows without data."""
    gains, unsupported = [r.gains.kp for r in schedule.rows], sum(not r.supported for r in schedule.rows)
    span = f"kp {number(min(gains))} .. {number(max(gains))} at {schedule.speeds[0]:.2f} .. {schedule.speeds[-1]:.2f} m/s"
    least = min(r.phase_margin_deg for r in schedule.rows)
    rows = f"{len(schedule.rows)} rows" + (f", {unsupported} without data" if unsupported else "")
    return f"{schedule.axis.value}, {schedule.kind}, {rows}: {span}, phase margin {least:.0f} deg or more"


def page(schedule: Schedule) -> Page:
    """Return a row of gains for each speed."""
    rows = tuple(
        (
            number(r.speed, 3),
            *(number(v, 4) for v in (r.gains.kp, r.gains.ki, r.gains.kd)),
            *(number(v, 3) for v in (r.feed_forward, r.fin_limit)),
            f"{r.phase_margin_deg:.0f}",
            "yes" if r.supported else "no",
            r.binds,
        )
        for r in schedule.rows
    )
    heads = ("m/s", "kp", "ki", "kd", "forward rad", "fin rad", "phase deg", "data", "bound by")
    known = facts(
        "Statistics",
        (
            ("damping", number(schedule.damping, 3)),
            ("phase margin", f"{number(schedule.phase_margin_deg, 3)} deg wished"),
            ("effects", listed(schedule.provenance.get("effects", ()))),
            ("signs", str(schedule.provenance.get("sign_convention", ""))),
            ("law", str(schedule.provenance.get("law", ""))),
            ("fins", "; ".join(schedule.fins_said)),
        ),
    )
    blocks = (known, Block("Gains", rows, heads, left=0))
    return Page(f"Schedule of the {schedule.axis.value} axis, {schedule.kind}", (), blocks)


def frames(schedule: Schedule) -> Mapping[str, Callable[[], DataFrame]]:
    """Return a row of gains for each speed."""
    return {"rows": lambda: table((body_of(r) for r in schedule.rows), "speed_m_s")}


def figures(schedule: Schedule) -> Mapping[str, Callable[[], Any]]:
    """Return gains, feed-forward and phase margin over speed."""
    from fieldsid.figures.schedule import gains_figure

    return {"gains": lambda: gains_figure(schedule)}


def system(schedule: Schedule, speed: float | None) -> Any:
    """Return the controller at a speed, without one those of the rows by speed."""
    from fieldsid.views._control import controller_system

    if speed is None:
        return {row.speed: controller_system(row, schedule.axis) for row in schedule.rows}
    return controller_system(schedule.at(speed), schedule.axis)


VIEW = View("schedule", line, page, frames, lambda schedule: schedule.axis.value, figures, system=system)
