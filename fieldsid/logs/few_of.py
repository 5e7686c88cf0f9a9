"""Names in a message: of many only the first are said."""

from __future__ import annotations

from collections.abc import Sequence

SHOWN = 12


def few_of(names: Sequence[str]) -> str:
    """Return names in a row, of many the first few."""
    return ", ".join(names[:SHOWN]) + ", ..." * (len(names) > SHOWN)
