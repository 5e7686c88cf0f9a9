"""Lists of names in messages, cut after the first few."""

from __future__ import annotations

from collections.abc import Sequence

SHOWN = 12


def few_of(names: Sequence[str]) -> str:
    """Return the names joined by commas, at most the first SHOWN of them."""
    return ", ".join(names[:SHOWN]) + ", ..." * (len(names) > SHOWN)
