"""Whiteness of series: the Ljung-Box statistic, pooled over runs, with its p-value; and the samples for each independent one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.tail_probabilities import chi_square_tail

LJUNG_BOX_LAGS = 20
FEWEST_SAMPLES = 4 * LJUNG_BOX_LAGS
"""Samples below which a series is left out of the test."""
MIN_WHITENESS_P = 0.01


def ljung_box(e: FloatArray) -> float:
    """Return the Ljung-Box statistic over LJUNG_BOX_LAGS lags; chi-square with as many degrees of freedom for a white series."""
    n = e.size
    centred = e - e.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return 0.0
    lags = np.array([float(centred[lag:] @ centred[:-lag]) / power for lag in range(1, LJUNG_BOX_LAGS + 1)])
    return float(n * (n + 2) * np.sum(lags**2 / (n - np.arange(1, LJUNG_BOX_LAGS + 1))))


def ljung_box_p(series: Iterable[FloatArray]) -> float:
    """Return the p-value of several series being white, from the sum of their statistics; one where all are too short."""
    statistics = [ljung_box(e) for e in series if e.size >= FEWEST_SAMPLES]
    return chi_square_tail(sum(statistics), LJUNG_BOX_LAGS * len(statistics)) if statistics else 1.0


MAX_RHO = 0.98


def inflation(parts: Sequence[FloatArray]) -> float:
    """Return the number of residuals, in parts of (n,) each, for each independent one: (1 + rho) / (1 - rho)."""
    power = sum(float(p @ p) for p in parts)
    rho = min(max(sum(float(p[1:] @ p[:-1]) for p in parts) / max(power, 1e-30), 0.0), MAX_RHO)
    return (1.0 + rho) / (1.0 - rho)
