"""The figure of a comparison: a free run against its measurement, the worst stretches shaded, and where each channel fails."""

from __future__ import annotations

from math import isfinite

from fieldsid.comparison.compare import Channel, Comparison, errors_in_words, left_in_words
from fieldsid.figures import bars, motion
from fieldsid.figures.panel import Bars, Panel, Picture
from fieldsid.models.model import Model
from fieldsid.rounding import DEGREES


def figure(found: Comparison, model: Model, name: str) -> Picture:
    """Return the panels of the motion, and at the right where each failing channel fails, the worse one at the top."""
    failing = found.failing
    effects = f" with {', '.join(model.effects)}" if model.effects else ""
    shaded = f"shaded: the worst stretches of the {failing[0].name}" if failing else "down to the noise"
    title = f"{name}{effects} on {found.run}, {model.axis.value}\n{facts(found)}; {shaded}"
    columns = (panels(found), tuple(map(_places, failing)))
    return Picture(title, (13.0, 8.2), columns[: 1 + bool(failing)], (1.75, 1.0)[: 1 + bool(failing)])


def panels(found: Comparison) -> tuple[Panel, ...]:
    """Return the panels of the motion; a channel that is down to the noise has no worst stretches."""
    spans = tuple((s.start_s, s.end_s) for c in found.failing[:1] for s in c.worst)
    return motion.panels([("simulated", "simulated", found.shown)], found.floor, spans)


def _places(channel: Channel) -> Bars:
    """Return the bars of where a channel fails."""
    at = f" most at {DEGREES.words(channel.where[0].condition)}" if channel.where else ""
    how = f"{left_in_words(channel.over_floor, channel.fit)}; {bars.LOOKS_AT}"
    return bars.places(channel.where, f"the {channel.name} fails{at}\n{how}", 6)


def facts(found: Comparison) -> str:
    """Return the line of facts: speed, rms against the noise, fit."""
    speed = found.shown.record.speed
    errors = (f"{name} {error}" for name, error in errors_in_words(found.merit, found.floor, DEGREES, 2))
    return "; ".join([*([f"{speed:.2f} m/s"] if isfinite(speed) else []), *errors])
