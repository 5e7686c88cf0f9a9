"""A change: what is different after a swap, parameter by parameter, and what that does to gains and turning radius."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from fieldsid.display import View
from fieldsid.page import Block, Page, facts, listed
from fieldsid.records.keys import body_of
from fieldsid.views._words import table, warned

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.change.record import Change


def line(found: Change) -> str:
    """Return what has changed and whether new gains are needed."""
    return found.line


def page(found: Change) -> Page:
    """Return the parameters with their changes, the gains and the radius before and after."""
    known = facts(
        "Statistics",
        (
            ("speeds", f"{listed([f'{s:.2f}' for s in found.speeds])} m/s"),
            ("effects only after", listed(found.added)),
            ("effects only before", listed(found.removed)),
        ),
    )
    parameters = tuple((p.word, p.state, p.says) for p in found.parameters)
    gains = tuple((f"{g.speed:.2f}", f"{g.old:.4f}", f"{g.new:.4f}", f"{100 * g.change:+.1f} %") for g in found.gains)
    radius = tuple((f"{r.side}, {r.speed:.2f} m/s", f"{r.old:.2f}", f"{r.new:.2f}") for r in found.radius)
    blocks = (
        known,
        Block("Parameters", parameters, ("", "state", "change"), left=3),
        Block("Gain kp", gains, ("m/s", "before", "after", "change"), left=0),
        Block("Turning radius in m", radius, ("", "before", "after")),
    )
    return Page(found.line, warned(found.notes), blocks)


def frames(found: Change) -> Mapping[str, Callable[[], DataFrame]]:
    """Return a row for each parameter, for each gain and for each turn."""
    body = body_of(found)
    parts = ("name", "what", "unit", "is_relative", "change", "std_error", "p_adjusted", "state")
    return {
        "parameters": lambda: table(({k: p[k] for k in parts} for p in body["parameters"]), "name"),
        "gains": lambda: table(body["gains"], "speed_m_s"),
        "radius": lambda: table(body["radius"]),
    }


def figures(found: Change) -> Mapping[str, Callable[[], Any]]:
    """Return both vehicles at the same fin, the changes and the gains."""
    from fieldsid.figures.change import figure

    return {"change": lambda: figure(found, ("before", "after"))}


VIEW = View("change", line, page, frames, lambda found: found.axis.value, figures)
