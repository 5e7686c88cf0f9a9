"""Several tests at once: p-values by Holm's step-down procedure (Holm 1979, Scandinavian Journal of Statistics 6, 65-70)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def adjusted(p_values: Sequence[float]) -> list[float]:
    """Return the p-values (n,) adjusted so that one below 0.05 is wrong in one family of tests out of twenty.

    Those that are NaN belong to no test and stay NaN.
    """
    p = np.asarray(p_values, dtype=np.float64)
    out = np.full(p.size, np.nan)
    order = [int(i) for i in np.argsort(p) if np.isfinite(p[i])]
    largest = 0.0
    for place, i in enumerate(order):
        largest = max(largest, min(1.0, (len(order) - place) * float(p[i])))
        out[i] = largest
    return [float(v) for v in out]
