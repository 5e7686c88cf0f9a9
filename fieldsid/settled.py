"""Where a number that is followed over time counts as settled: near its last value, by a share of that or by its error."""

from __future__ import annotations

SETTLED_SHARE = 0.05


def settled_band(last: float, error: float) -> float:
    """Return how far from its last value a number may be and counts as settled; `error` is how far it may be by chance."""
    return max(SETTLED_SHARE * abs(last), error)
