"""A prediction of turns: radius over speed to both sides with bands, and the measured circles."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees
from typing import TYPE_CHECKING, Any

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, cut
from fieldsid.records.keys import body_of
from fieldsid.rounding import RADIANS, Angles, number, with_error
from fieldsid.views._words import table, warned

if TYPE_CHECKING:
    from fieldsid.turning.prediction import TurnPrediction


def line(found: TurnPrediction) -> str:
    """Return the tightest turn of both sides with its 95 % band, and what it rests on."""
    return f"tightest turn {tightest(min(map(body_of, found.rows), key=lambda r: float(r['radius_m'])))}"


def tightest(row: Mapping[str, Any]) -> str:
    """Return a turn in words, of the JSON of its row."""
    from fieldsid.turning.prediction import turn_words

    where = f"to {row['side']} at {number(row['speed_m_s'], 3)} m/s"
    return f"{turn_words(float(row['radius_m']), row['interval95'], where)}, {row['trust']}"


def page(found: TurnPrediction, angles: Angles = RADIANS) -> Page:
    """Return a row for each speed and side, the measured circles, why rows are extrapolated, and what would settle it."""
    turns, bracketed = turns_of(body_of(found), angles)
    because, count = [b for r in found.rows for b in r.because], len(found.rows)
    shares = {b: "" if because.count(b) == count else f" ({because.count(b)} of {count} turns)" for b in because}
    blocks: tuple[Block | str, ...] = (
        turns,
        bracketed,
        _circles(found, angles),
        *(f"extrapolated{share}: {b}" for b, share in shares.items()),
        *(f"what would settle it: {settling}" for settling in found.settling),
        *(f"tightest at higher speed, {s}: {b.radius:.2f} m at {b.speed:.2f} m/s" for s, b in found.minimum.items() if b),
    )
    return Page(f"Turns with {turns.title}", warned(found.notes), blocks)


def turns_of(body: Mapping[str, Any], angles: Angles) -> tuple[Block, str]:
    """Return a row for each speed and side, of the JSON that a file of it holds too, and what its brackets are."""
    from fieldsid.turning.prediction import BRACKETED, found_by, is_band_only, radius_cell

    rows = tuple(
        (
            r["side"],
            number(r["speed_m_s"], 3),
            radius_cell(r["radius_m"], r["interval95"]),
            f"{number(r['interval95'][0], 3)} .. {number(r['interval95'][1], 3)}",
            r["trust"],
            number(r.get("model_radius_m"), 3),
            number(degrees(r["yaw_rate_max_rad_s"]), 3),
            number(r.get("u_turn_time_s"), 3),
        )
        for r in body["rows"]
    )
    rudder = f"rudder {angles.factor * body['rudder_max_rad']:.4g} {angles.unit}" if "rudder_max_rad" in body else ""
    found = found_by(r["method"] for r in body["rows"] if "method" in r)
    bracketed = any(is_band_only(r["radius_m"], r["interval95"]) for r in body["rows"])
    heads = ("side", "m/s", "radius m", "95 %", "trust", "model's", "deg/s", "u-turn s")
    return Block(", ".join(filter(None, (rudder, found))), rows, heads), BRACKETED if bracketed else ""


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
