"""Which effects of a catalogue can be tried on some runs at all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fieldsid.models.effect import Effect
from fieldsid.models.record import Record


def usable(catalogue: Iterable[Effect], records: Sequence[Record]) -> tuple[tuple[Effect, ...], dict[str, str]]:
    """Return the effects whose signals every run has, and why each other one is skipped."""
    kept, skipped = [], {}
    for effect in catalogue:
        missing = sorted({role for role in effect.needs for r in records if role not in r.signals})
        if missing:
            skipped[effect.name] = f"needs {', '.join(missing)}, which the log lacks"
        else:
            kept.append(effect)
    return tuple(kept), skipped
