"""Are series white? The Ljung-Box statistic, pooled over runs, and its chi-square tail."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fieldsid.fitting.tails import chi_square_tail
from fieldsid.logs.run import FloatArray

LAGS = 20
LEAST = 4 * LAGS
"""Samples below which a series says nothing."""
WHITE_ENOUGH = 0.01


def ljung_box(e: FloatArray) -> float:
    """Return the Ljung-Box statistic of a series over LAGS lags (chi-square with LAGS degrees when white)."""
    n = e.size
    centred = e - e.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return 0.0
    lags = np.array([float(centred[lag:] @ centred[:-lag]) / power for lag in range(1, LAGS + 1)])
    return float(n * (n + 2) * np.sum(lags**2 / (n - np.arange(1, LAGS + 1))))


def white_p(series: Iterable[FloatArray]) -> float:
    """Return the p-value of several series being white, their statistics summed; one where all are too short to say."""
    told = [ljung_box(e) for e in series if e.size >= LEAST]
    return chi_square_tail(sum(told), LAGS * len(told)) if told else 1.0
