"""Spikes taken out of signals as their samples come, two samples late: the rule of `convert/faults/spikes.py` on a window."""

from __future__ import annotations

from math import inf, isfinite, nan

import numpy as np

from fieldsid.logs.convert.faults.spikes import spike_limit
from fieldsid.numerics.arrays import FloatArray

LOOKED_AT = 256
EVERY = LOOKED_AT // 2
"""Samples that the limit is learnt from, and samples between two looks."""


class SpikeGate:
    """The last samples of one signal: `push` takes the newest value and returns the one before the last, NaN for a spike."""

    __slots__ = ("_limit", "_recent", "_seen", "spikes")

    def __init__(self) -> None:
        self._recent, self._seen, self._limit, self.spikes = np.full(LOOKED_AT, nan), 0, inf, 0

    def push(self, value: float) -> float:
        """Take a value, NaN where nothing was measured; return that of two samples before."""
        recent = self._recent
        recent[:-1] = recent[1:]
        recent[-1] = value
        self._seen += 1
        if self._seen % EVERY == 0:
            known = recent[np.isfinite(recent)]
            self._limit = spike_limit(known) if known.size >= EVERY else inf
        middle = float(recent[-3])
        if self._limit < inf and self._is_spike(recent[-5:]):
            self.spikes += 1
            recent[-3] = nan
            return nan
        return middle

    def state(self) -> dict[str, object]:
        """Return all of it as plain values; NaN as None."""
        limit = self._limit if isfinite(self._limit) else None
        values = [v if isfinite(v) else None for v in self._recent.tolist()]
        return {"recent": values, "seen": self._seen, "limit": limit, "spikes": self.spikes}

    def restore(self, state: dict[str, object]) -> None:
        """Go on from a state; raises ValueError, TypeError or KeyError where it is none."""
        self._recent[:] = np.array(state["recent"], dtype=np.float64)
        self._seen, self.spikes = int(state["seen"]), int(state["spikes"])  # type: ignore[call-overload]
        self._limit = inf if state["limit"] is None else float(state["limit"])  # type: ignore[arg-type]

    def _is_spike(self, five: FloatArray) -> bool:
        a, b, c, d, e = (float(v) for v in five.tolist())
        if not isfinite(a + b + c + d + e):
            return False
        middle = c - 0.5 * (b + d)
        sign = 1.0 if middle > 0.0 else -1.0
        distances = (sign * (c - 2.0 * b + a), sign * middle, sign * (c - 2.0 * d + e))
        return min(distances) > self._limit
