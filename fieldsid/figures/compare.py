"""The figure of a comparison: a free run against its measurement, the worst stretches shaded, and where each channel fails."""

from __future__ import annotations

from fieldsid.comparison.compare import Channel, Comparison, left_in_words
from fieldsid.figures import bars, motion
from fieldsid.figures.panel import Bars, Panel, Picture
from fieldsid.rounding import DEGREES


def figure(found: Comparison, says: str) -> Picture:
    """Return the panels of the motion, and at the right where each failing channel fails, the worse one at the top."""
    failing = found.failing
    title = f"{says}\nshaded: the worst stretches of the {failing[0].name}" if failing else says
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
