"""The figure of the modelling loop: where the first model fails, the free run with the effects added, the error step by step."""

from __future__ import annotations

from fieldsid.extension.lineage import Loop
from fieldsid.figures import bars, motion
from fieldsid.figures.panel import Bars, Panel, Picture
from fieldsid.rounding import DEGREES


def figure(found: Loop) -> Picture:
    """Return four panels: failure of the first model, its places, the last model, the error after each step."""
    at = f", most at {DEGREES.words(found.where[0].condition)}" if found.where else ""
    before, after = found.left_by(found.before), found.left_by(found.after)
    title = f"{found.before.run}: {found.start} {before}{at}; with {', '.join(found.added)} {after}"
    first, where, last, errors = panels(found)
    return Picture(title, (13.0, 8.4), ((first, last), (where, errors)), (1.5, 1.0))


def panels(found: Loop) -> tuple[Panel, Bars, Panel, Bars]:
    """Return the channel that the first model fails most in, its places, the last model over it, and the error step by step."""
    worst, named = found.before.worst_channel, "+".join(found.added)
    spans, index = [(s.start_s, s.end_s) for s in worst.worst], int(worst.name == "rate")
    shown = [(found.start, "second", found.before.shown), (f"with {named}", "simulated", found.after.shown)]
    gains = [g.step.gain for g in found.line if g.step]
    return (
        motion.channel(shown[:1], index, spans, f"1. the {found.start} fails: {found.left_by(found.before)}", x="time, s"),
        bars.places(found.where, f"2. where; {bars.LOOKS_AT}", 8),
        motion.channel(shown, index, spans, f"3. with {named}: {found.left_by(found.after)}", x="time, s"),
        bars.steps(gains, found.before.model.effects, "4. the error step by step"),
    )
