"""A prediction of turns: radius over speed to both sides with bands, and the measured circles."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.kinds import sketch
from fieldsid.page import Block, Page, cut
from fieldsid.records.keys import body_of
from fieldsid.rounding import RADIANS, Angles, number, with_error
from fieldsid.views._words import joined, some, table, warned

if TYPE_CHECKING:
    from fieldsid.turning import TurnPrediction


def line(found: TurnPrediction) -> str:
    """Return rudder, method, the span of the radii over that of the speeds, and what the rows rest on."""
    ends = [r.interval95 if r.band_only else (r.radius, r.radius) for r in found.rows]
    speeds = [r.speed for r in found.rows]
    low, high = number(min(e[0] for e in ends), 3), number(max(e[1] for e in ends), 3)
    radii = f"{'95 % in ' if any(r.band_only for r in found.rows) else ''}{low} .. {high} m"
    span = f"{radii} at {min(speeds):.2f} .. {max(speeds):.2f} m/s"
    trust = ", ".join(dict.fromkeys(r.trust for r in found.rows))
    more = joined(trust, some(len(found.measured), "measured circle"), some(len(found.notes), "warning"))
    return f"rudder {found.rudder_max:.4g} rad, {_methods(found)}: radius {span}, {more}"


def page(found: TurnPrediction, angles: Angles = RADIANS) -> Page:
    """Return a row for each speed and side, the measured circles, why rows are extrapolated, and what would settle it."""
    from fieldsid.turning.known_radius import BRACKETED, radius_cell
    from fieldsid.turning.prediction import found_by

    rows = tuple(
        (
            r.side,
            number(r.speed, 3),
            radius_cell(r.radius, r.interval95),
            f"{number(r.interval95[0], 3)} .. {number(r.interval95[1], 3)}",
            number(r.of_model, 3),
            number(degrees(r.yaw_rate_max), 3),
            number(r.u_turn_time, 3),
            r.trust,
        )
        for r in found.rows
    )
    heads = ("side", "m/s", "radius m", "95 %", "model's", "deg/s", "u-turn s", "trust")
    rudder = f"rudder {angles.factor * found.rudder_max:.4g} {angles.unit}, {found_by(r.method for r in found.rows)}"
    because = [b for r in found.rows for b in r.because]
    shares = {b: "" if because.count(b) == len(rows) else f" ({because.count(b)} of {len(rows)} turns)" for b in because}
    blocks: tuple[Block | str, ...] = (
        Block(rudder, rows, heads),
        BRACKETED if any(r.band_only for r in found.rows) else "",
        _circles(found, angles),
        *(f"extrapolated{share}: {b}" for b, share in shares.items()),
        *(f"what would settle it: {settling}" for settling in found.settling),
        *(f"tightest at higher speed, {s}: {b.radius:.2f} m at {b.speed:.2f} m/s" for s, b in found.minimum.items() if b),
    )
    return Page(f"Turns with {rudder}", warned(found.notes), blocks)


def _circles(found: TurnPrediction, angles: Angles) -> Block:
    rows = tuple(
        (
            cut(m.turn.run, 60),
            number(m.turn.flown_at, 3),
            number(angles.factor * m.turn.fin, 3),
            with_error(m.turn.circle.radius, m.turn.circle.radius_std_error),
            number(m.predicted),
            f"{number(m.predicted95[0], 3)} .. {number(m.predicted95[1], 3)}",
            f"{m.difference_percent:+.1f}",
        )
        for m in found.measured
    )
    heads = ("run", "m/s", "fin", "radius m", "predicted", "95 %", "off %")
    return Block("measured circles, and what the other runs alone predict", rows, heads)


def frames(found: TurnPrediction) -> Frames:
    """Return a row for each speed and side, and the measured circles."""
    return {"rows": lambda: table(map(body_of, found.rows)), "measured": lambda: table(map(body_of, found.measured))}


def _methods(found: TurnPrediction) -> str:
    return ", ".join(sorted({r.method for r in found.rows}))


def figures(found: TurnPrediction) -> Figures:
    """Return radius and u-turn time over speed."""
    return {"radius": sketch("turn", found)}


VIEW = View("turn_prediction", line, page, frames, _methods, figures)
