"""A verification: margins and steps of a schedule over the identified set, against those of one constant gain."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from fieldsid.display import View
from fieldsid.page import Block, Page, facts
from fieldsid.records.keys import body_of
from fieldsid.rounding import number
from fieldsid.views._words import table

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.schedule import Verification


def line(found: Verification) -> str:
    """Return the least margins and the most overshoot over speeds and the set."""
    worst = found.worst
    margins = f"phase margin {worst['phase_margin_deg']:.0f} deg, gain margin {_decibels(worst['gain_margin_db'])}"
    step = f"delay margin {number(worst['delay_margin_s'], 2)} s at least, overshoot {worst['overshoot_percent']:.0f} % at most"
    return f"{found.schedule.axis.value}, {len(found.scheduled)} speeds: {margins}, {step}"


def page(found: Verification) -> Page:
    """Return a row for each speed, with the settling time of one constant gain."""
    rows = tuple(
        (
            number(a.speed, 3),
            f"{a.phase_deg:.0f}",
            f"{a.phase_least_deg:.0f}",
            _decibels(a.gain_least_db),
            number(a.delay_least_s, 2),
            f"{100 * a.overshoot:.0f}",
            f"{100 * a.overshoot_most:.0f}",
            number(a.settling, 3),
            number(b.settling, 3),
        )
        for a, b in zip(found.scheduled, found.constant, strict=True)
    )
    heads = ("m/s", "phase deg", "least", "gain margin", "delay s", "over %", "most", "settles s", "constant gain s")
    worst = found.worst
    least = facts(
        "Least margins and most overshoot, over all speeds and the identified set",
        (
            ("phase margin", f"{worst['phase_margin_deg']:.1f} deg"),
            ("gain margin", f"{_decibels(worst['gain_margin_db'])}"),
            ("delay margin", f"{number(worst['delay_margin_s'], 3)} s"),
            ("overshoot", f"{worst['overshoot_percent']:.1f} %"),
        ),
    )
    title = f"Verification of the {found.schedule.axis.value} schedule, {found.schedule.kind}"
    return Page(title, (), (least, Block("Margins and steps", rows, heads, left=0)))


def frames(found: Verification) -> Mapping[str, Callable[[], DataFrame]]:
    """Return the checks of the schedule and those of one constant gain."""
    return {
        "scheduled": lambda: table((body_of(c) for c in found.scheduled), "speed_m_s"),
        "constant": lambda: table((body_of(c) for c in found.constant), "speed_m_s"),
    }


def figures(found: Verification) -> Mapping[str, Callable[[], Any]]:
    """Return gains and margins over speed, with the steps."""
    from fieldsid.figures.schedule import figure

    return {"steps": lambda: figure(found.schedule, found)}


def _decibels(margin: float) -> str:
    return "infinite" if margin == float("inf") else f"{margin:.1f} dB"


VIEW = View("verification", line, page, frames, lambda found: found.schedule.axis.value, figures)
