"""Is a series white? The Ljung-Box statistic and its chi-square tail."""

from __future__ import annotations

import numpy as np

from fieldsid.logs.run import FloatArray

LAGS = 20
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
