"""The effects of a catalogue that can be tried on some runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from fieldsid.models.effect import Effect
from fieldsid.models.record import Record


def applicable_effects(catalogue: Iterable[Effect], records: Sequence[Record]) -> tuple[tuple[Effect, ...], dict[str, str]]:
    """Return the effects whose signals every run has, with their applicable variants, and why each other effect is skipped."""
    kept, skipped = [], {}
    for effect in catalogue:
        missing, columns = _missing(effect.needs, records), sorted({r.thrust_column for r in records if r.thrust_column})
        if missing:
            skipped[effect.name] = f"needs {', '.join(missing)}, {_why(missing, records)}"
        elif "thrust" in effect.needs and len(columns) > 1:
            skipped[effect.name] = f"needs one thrust for all runs, and they log it as {' and as '.join(columns)}"
        else:
            forms = [f for f in effect.variants if not _missing(f.needs, records) and all(r.axis in f.axes for r in records)]
            kept.append(effect if len(forms) == len(effect.variants) else replace(effect, variants=tuple(forms)))
    return tuple(kept), skipped


def _why(missing: Sequence[str], records: Sequence[Record]) -> str:
    """Return the distinct reasons why roles are missing."""
    return ", ".join(dict.fromkeys(r.why_without(role) for role in missing for r in records if role not in r.signals))


def _missing(needs: Iterable[str], records: Sequence[Record]) -> list[str]:
    """Return the roles that some run lacks."""
    return sorted({role for role in needs for r in records if role not in r.signals})
