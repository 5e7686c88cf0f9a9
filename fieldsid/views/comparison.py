"""A comparison: the error of a model's free run on one run, where it fails, and which signals explain the missing moment."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, Whole, cut
from fieldsid.records.keys import body_of
from fieldsid.rounding import DEGREES, MANY, RADIANS, Angles
from fieldsid.views._words import merit_blocks, percent, table, warned, where_block

if TYPE_CHECKING:
    from fieldsid.comparison.compare import Comparison

MOST_PLACES = 6


def line(found: Comparison) -> str:
    """Return the run with its error and fit, and where the model fails most."""
    return verdict([found])


def verdict(found: Sequence[Comparison], angles: Angles = RADIANS) -> str:
    """Return the error of the worst run and over all runs, and where the model fails most on the worst, or that none is left."""
    from fieldsid.comparison.sufficient import is_noise, pooled

    worst, over = max(found, key=lambda c: c.badness), pooled(c.over_noise for c in found)
    channel = worst.worst_channel
    error = f"error {worst.over_noise:.2f} x the noise, " if worst.over_noise < MANY else ""
    says = f"{cut(worst.run, 60)}: {error}{channel.name} fit {channel.fit:.1f} %"
    says += f"; over all {len(found)} runs {over:.2f} x" if len(found) > 1 and over < MANY else ""
    if is_noise(over):
        return f"{says}: nothing is left but the noise"
    fails = channel in worst.failing and channel.where
    return f"{says}; fails most at {angles.words(channel.where[0].condition)}" if fails else says


def page(found: Comparison, angles: Angles = RADIANS) -> Page:
    """Return errors, fits and the places of the error."""
    errors = merit_blocks([(found.run, found.shown.record.speed, found.merit, found.floor)], angles)
    return Page(f"Comparison with {verdict([found], angles)}", warned(found.shown.notes), (*errors, *blocks_of(found, angles)))


def blocks_of(found: Comparison, angles: Angles = RADIANS, top: int = MOST_PLACES) -> Iterator[Block | str]:
    """Yield where each channel fails, the worse first, which channels are down to their noise, and the missing moment."""
    from fieldsid.comparison.compare import left_in_words

    for c in found.failing:
        yield where_block(f"{found.run}: where the {c.name} fails, {left_in_words(c.over_floor, c.fit)}", c.where, angles, top)
    quiet = [f"{c.name} {c.over_floor:.2f} x" for c in found.channels if c not in found.failing]
    pooled = "" if found.failing else f", {found.over_noise:.2f} x"
    at_noise = f"{found.run}: down to the noise{pooled}: {', '.join(quiet)}" if quiet else ""
    yield Whole(at_noise if found.failing or not at_noise else f"\n{at_noise}")
    signals = ", ".join(f"{c.signal} ({percent(c.explained)})" for c in found.moves_with[:3])
    yield f"the missing moment moves with {signals}" if found.failing and signals else ""


def frames(found: Comparison) -> Frames:
    """Return the errors in one row, where they fall, and the motion over time."""
    from fieldsid.views.fit import motion

    row: dict[str, Any] = {
        "run": found.run,
        "speed_m_s": found.shown.record.speed,
        **body_of(found.merit),
        "angle_noise_rad": found.floor.angle,
        "rate_noise_rad_s": found.floor.rate,
        "judged_by": found.worst_channel.name,
        "theil": found.worst_channel.metrics.theil,
        "r2": found.worst_channel.metrics.r2,
        "whiteness_p": found.worst_channel.metrics.whiteness_p,
    }
    return {
        "errors": lambda: table([row], "run"),
        "where": lambda: table(map(body_of, found.where)),
        "motion": lambda: motion((found.shown,)),
    }


def figures(found: Comparison) -> Figures:
    """Return the free run against its measurement, and where the error falls."""
    return {"motion": sketch("compare", found, f"the model on {verdict([found], DEGREES)}")}


VIEW = View("comparison", line, page, frames, lambda found: found.run, figures)
