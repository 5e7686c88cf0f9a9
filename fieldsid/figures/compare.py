"""The figure of a comparison: a free run against its measurement, the worst stretches shaded, and where each channel fails."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from textwrap import fill

from matplotlib.figure import Figure, SubFigure

from fieldsid.comparison.compare import Channel, Comparison, errors_in_words, left_in_words
from fieldsid.figures import canvas, motion, where
from fieldsid.models.model import Model
from fieldsid.rounding import DEGREES

MOST_BARS = 12
TITLE_WIDTH = 38


def figure(found: Comparison, model: Model, name: str) -> Figure:
    """Return a sheet with the four panels of the motion, and at the right where the error of each failing channel falls."""
    failing = found.failing
    effects = f" with {', '.join(model.effects)}" if model.effects else ""
    title = f"{name}{effects} on {found.run}, {model.axis.value}"
    shaded = f"shaded: the worst stretches of the {failing[0].name}" if failing else "down to the noise"
    sheet = canvas.sheet(13.0, 8.2, f"{title}\n{facts(found)}; {shaded}")
    halves = sheet.subfigures(1, 2 if failing else 1, squeeze=False, width_ratios=(1.75, 1.0) if failing else None)
    left = halves[0, 0]
    axes = left.subplots(4, 1, sharex=True, height_ratios=(1.25, 1.25, 0.9, 1.0))
    motion.draw(view_of(found), list(axes))
    left.align_ylabels(list(axes))
    if failing:
        _draw_places(failing, halves[0, 1])
    return sheet


def _draw_places(failing: Sequence[Channel], right: SubFigure) -> None:
    """Draw where each failing channel fails, the worse one at the top."""
    for channel, ax in zip(failing, right.subplots(len(failing), 1, squeeze=False)[:, 0], strict=True):
        shown = channel.where[: MOST_BARS // len(failing)]
        where.draw(shown, ax)
        at = f" most at {DEGREES.words(shown[0].condition)}" if shown else ""
        says = f"the {channel.name} fails{at}"
        how = f"{left_in_words(channel.over_floor, channel.fit)}; beside a bar: rms there\nover that of the whole run"
        ax.set_title(f"{fill(says, TITLE_WIDTH)}\n{how}", loc="left", fontsize=10)


def view_of(found: Comparison) -> motion.MotionView:
    """Return the panels' view of a comparison; a channel that is down to the noise has no worst stretches."""
    shown, floor = found.shown, found.floor
    spans = tuple((s.start_s, s.end_s) for c in found.failing[:1] for s in c.worst)
    return motion.MotionView(shown.record, shown.angle, shown.rate, shown.fin, floor.angle, floor.rate, spans)


def facts(found: Comparison) -> str:
    """Return the line of facts: speed, rms against the noise, fit."""
    speed = found.shown.record.speed
    errors = (f"{name} {error}" for name, error in errors_in_words(found.merit, found.floor, DEGREES, 2))
    return "; ".join([*([f"{speed:.2f} m/s"] if isfinite(speed) else []), *errors])
