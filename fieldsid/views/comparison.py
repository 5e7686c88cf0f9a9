"""A comparison: how well a model's free run follows one run, where it fails, and what the missing moment moves with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.kinds import sketch
from fieldsid.page import Block, Page, cut, facts
from fieldsid.records.keys import body_of
from fieldsid.rounding import number, p_value, times_noise
from fieldsid.views._words import error_facts, percent, speed_words, table, warned, where_block, where_rows

if TYPE_CHECKING:
    from fieldsid.comparison.compare import Comparison


def line(found: Comparison) -> str:
    """Return the run, fit and error of the channel furthest above its noise, and where that fails most."""
    channel, m = found.leading, found.merit
    fit = m.rate_fit if channel.name == "rate" else m.angle_fit
    worst = f", worst at {channel.where[0].condition}" if found.failing and channel.where else ""
    return f"{cut(found.run, 60)}: {channel.name} fit {fit:.1f} %, error {times_noise(found.over_noise)}{worst}"


def page(found: Comparison) -> Page:
    """Return errors, metrics and the places of the error."""
    m = found.leading.metrics
    known = facts(
        "Statistics",
        (
            ("speed", speed_words(found.shown.record.speed)),
            *error_facts(found.merit, found.floor),
            ("judged by", f"the {found.leading.name}: Theil {number(m.theil, 3)}, R^2 {number(m.r2, 3)}"),
            ("whiteness", p_value(m.whiteness_p)),
        ),
    )
    failing = tuple(where_block(f"Where the {channel.name} fails", channel.where) for channel in found.failing)
    companions = tuple((c.signal, percent(c.explained)) for c in found.moves_with[:3] if found.failing)
    blocks = (known, *failing, Block("The missing moment moves with", companions))
    return Page(f"Comparison with {cut(found.run, 60)}", warned(found.shown.notes), blocks)


def frames(found: Comparison) -> Frames:
    """Return the errors in one row, where they fall, and the motion over time."""
    from fieldsid.views.fit import motion

    row: dict[str, Any] = {
        "run": found.run,
        "speed_m_s": found.shown.record.speed,
        **body_of(found.merit),
        "angle_noise_rad": found.floor.angle,
        "rate_noise_rad_s": found.floor.rate,
        "judged_by": found.leading.name,
        "theil": found.leading.metrics.theil,
        "r2": found.leading.metrics.r2,
        "whiteness_p": found.leading.metrics.whiteness_p,
    }
    return {
        "errors": lambda: table([row], "run"),
        "where": lambda: table(where_rows(found.where)),
        "motion": lambda: motion((found.shown,)),
    }


def figures(found: Comparison) -> Figures:
    """Return the free run against its measurement, and where the error falls."""
    return {"motion": sketch("compare", found, found.model, "the model")}


VIEW = View("comparison", line, page, frames, lambda found: found.run, figures)
