"""A change: what is different after a swap, parameter by parameter, and what that does to gains and turning radius."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, isfinite
from typing import TYPE_CHECKING

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page
from fieldsid.records.keys import body_of
from fieldsid.rounding import with_error
from fieldsid.views._words import table, warned

if TYPE_CHECKING:
    from fieldsid.change.record import Change, ParameterChange


def line(found: Change) -> str:
    """Return what has changed and whether new gains are needed."""
    return found.line


def page(found: Change) -> Page:
    """Return the parameters with their changes, the gains and the radius before and after."""
    return Page(found.line, warned(found.notes), tuple(blocks_of(found)))


def blocks_of(found: Change, title: str = "") -> Iterator[Block | str]:
    """Yield the parameters at each speed and over all, the gains and the radius, before and after."""
    rows = tuple(row for p in found.parameters for row in _rows(p))
    yield Block(title, rows, ("", "m/s", "before", "after", "change  "))
    yield "* beyond its errors, all tests together wrong in one comparison of twenty"
    gains = tuple(
        (
            f"{g.speed:.2f}", f"{g.old:.4f}", f"{g.new:.4f}", f"{100 * g.change:+.1f} %",
            f"{100 * g.interval95[0]:+.1f} .. {100 * g.interval95[1]:+.1f}", f"{g.damping_with_old:.2f}",
            f"{g.phase_with_old_deg:.0f}",
        )
        for g in found.gains
    )  # fmt: skip
    yield Block("gain kp", gains, ("m/s", "before", "after", "change", "95 %", "damping", "phase deg"))
    yield "damping, phase: of the loop as it is now, with the gains of before" if gains else ""
    turns = tuple(
        (r.side, f"{r.speed:.2f}", f"{r.old:.2f}", f"{r.new:.2f}", f"{100 * (r.new / r.old - 1):+.1f} %") for r in found.radius
    )
    at = "" if found.rudder is None else f" at {found.rudder:.3g} rad"
    yield Block(f"turning radius in m{at}", turns, ("side", "m/s", "before", "after", "change"))


def _rows(p: ParameterChange) -> Iterator[tuple[str, ...]]:
    from fieldsid.change.record import CHANGED, TRIM_ANGLE

    is_trim = p.name == TRIM_ANGLE
    name = p.word if p.word == p.name else "trim, deg" if is_trim else f"{p.word} {p.name}"
    scale = degrees(1.0) if is_trim else 1.0
    for i, a in enumerate(p.speeds):
        values = (with_error(scale * a.old, scale * a.old_std_error), with_error(scale * a.new, scale * a.new_std_error))
        change = _amount(p, a.change, a.std_error) + (" *" if a.is_beyond_errors else "  ")
        yield name if i == 0 else "", f"{a.speed:.2f}" if isfinite(a.speed) else "all", *values, change
    if len(p.speeds) > 1:
        yield "", "all", "", "", _amount(p, p.change, p.std_error) + (" *" if p.state == CHANGED else "  ")


def _amount(p: ParameterChange, change: float, error: float) -> str:
    from fieldsid.change.record import TRIM_ANGLE

    factor = 100.0 if p.is_relative else degrees(1.0) if p.name == TRIM_ANGLE else 1.0
    return f"{'+' if change > 0 else ''}{with_error(factor * change, factor * error)}{' %' if p.is_relative else ''}"


def frames(found: Change) -> Frames:
    """Return a row for each parameter, for each gain and for each turn."""
    body = body_of(found)
    parts = ("name", "what", "unit", "is_relative", "change", "std_error", "p_adjusted", "state")
    return {
        "parameters": lambda: table(({k: p[k] for k in parts} for p in body["parameters"]), "name"),
        "gains": lambda: table(body["gains"], "speed_m_s"),
        "radius": lambda: table(body["radius"]),
    }


def figures(found: Change) -> Figures:
    """Return both vehicles at the same fin, the changes and the gains."""
    return {"change": sketch("change", found, ("before", "after"))}


VIEW = View("change", line, page, frames, lambda found: found.axis.value, figures)
