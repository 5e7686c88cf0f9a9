"""The effects that the headings of some runs can show."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

import numpy as np

from fieldsid.models.effect import Effect
from fieldsid.models.record import Record

TURN_RAD = 2.0 * np.pi


def shown_by_headings(
    effects: Iterable[Effect], records: Sequence[Record], known: Collection[str]
) -> tuple[tuple[Effect, ...], dict[str, str]]:
    """Return the effects that the measured headings can show, and the reason for each one left out; `known` effects are kept."""
    span, effects = heading_span(records), list(effects)
    narrow = {e.name: e.heading_span for e in effects if e.name not in known and span < e.heading_span}
    flown = f"the runs keep within {np.degrees(span):.0f} deg" if any(r.angle_ok.any() for r in records) else "none is measured"
    kept = tuple(e for e in effects if e.name not in narrow)
    return kept, {
        name: f"needs headings at least {np.degrees(least):.0f} deg apart, and {flown}" for name, least in narrow.items()
    }


def heading_span(records: Sequence[Record]) -> float:
    """Return the smallest arc (rad) that contains every measured heading of some runs; zero where none was measured."""
    headings = np.sort(np.mod(np.concatenate([r.angle[r.angle_ok] for r in records]), TURN_RAD))
    if not headings.size:
        return 0.0
    return float(TURN_RAD - np.diff(headings, append=headings[0] + TURN_RAD).max())
