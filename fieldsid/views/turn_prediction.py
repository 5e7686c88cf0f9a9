"""A prediction of turns: radius over speed to both sides with bands, and the measured circles."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from fieldsid.display import View
from fieldsid.page import Block, Page, cut
from fieldsid.records.keys import body_of
from fieldsid.rounding import interval, number, with_error
from fieldsid.views._words import counted, joined, table, warned

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.turning import TurnPrediction


def line(found: TurnPrediction) -> str:
    """Return rudder, method, the span of the radii over that of the speeds, and what the rows rest on."""
    ends = [r.interval95 if r.band_only else (r.radius, r.radius) for r in found.rows]
    speeds = [r.speed for r in found.rows]
    low, high = number(min(e[0] for e in ends), 3), number(max(e[1] for e in ends), 3)
    radii = f"{'95 % in ' if any(r.band_only for r in found.rows) else ''}{low} .. {high} m"
    span = f"{radii} at {min(speeds):.2f} .. {max(speeds):.2f} m/s"
    trust = ", ".join(dict.fromkeys(r.trust for r in found.rows))
    more = joined(trust, counted(len(found.measured), "measured circle"), counted(len(found.notes), "warning"))
    return f"rudder {found.rudder_max:.4g} rad, {_methods(found)}: radius {span}, {more}"


def page(found: TurnPrediction) -> Page:
    """Return a row for each speed and side, the measured circles, and why rows are extrapolated."""
    from fieldsid.turning.known_radius import BRACKETED, radius_cell

    rows = tuple(
        (
            r.side,
            number(r.speed, 3),
            radius_cell(r.radius, r.interval95),
            *(number(v, 3) for v in (*r.interval95, r.yaw_rate_max, r.u_turn_time)),
            r.trust,
        )
        for r in found.rows
    )
    heads = ("", "m/s", "radius m", "from", "to (95 %)", "rad/s", "180 deg s", "trust")
    circles = tuple(
        (
            cut(m.turn.run, 60),
            number(m.turn.flown_at, 3),
            number(m.turn.fin, 3),
            with_error(m.turn.circle.radius, m.turn.circle.radius_std_error),
            number(m.predicted, 3),
            interval(*m.predicted95),
        )
        for m in found.measured
    )
    because = dict.fromkeys(b for r in found.rows for b in r.because)
    settle = next((r.settle_with for r in found.rows if r.because), "")
    bracketed = (BRACKETED,) if any(r.band_only for r in found.rows) else ()
    closing = (*bracketed, *(f"extrapolated: {b}" for b in because), *((f"what would settle it: {settle}",) if settle else ()))
    measured = Block("Measured circles", circles, ("", "m/s", "fin rad", "radius m", "predicted", "95 %"))
    title = f"Turns with {found.rudder_max:.4g} rad of rudder, {_methods(found)}"
    return Page(title, warned(found.notes), (Block("Radius", rows, heads), measured), closing)


def frames(found: TurnPrediction) -> Mapping[str, Callable[[], DataFrame]]:
    """Return a row for each speed and side, and the measured circles."""
    return {"rows": lambda: table(map(body_of, found.rows)), "measured": lambda: table(map(body_of, found.measured))}


def figures(found: TurnPrediction) -> Mapping[str, Callable[[], Any]]:
    """Return radius and u-turn time over speed."""
    from fieldsid.figures.turn import figure

    return {"radius": lambda: figure(found)}


def _methods(found: TurnPrediction) -> str:
    return ", ".join(sorted({r.method for r in found.rows}))


VIEW = View("turn_prediction", line, page, frames, _methods, figures)
