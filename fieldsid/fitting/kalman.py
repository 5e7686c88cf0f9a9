"""The Kalman filter of the motion that disturbances and coloured sensor noise cause: which of three a noise asks for.

State (y, p, w, n_y, n_p), see fitting/whitening.py; a noise is a vector (7,) in the order of whitening.NOISE_FIELDS. What is
zero for good is left out, and each filter is compiled only once it is asked for.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.kalman_both import both
from fieldsid.fitting.kalman_sea import sea
from fieldsid.fitting.kalman_sensors import sensors
from fieldsid.logs.run import FloatArray


def filtered(
    steps: FloatArray,
    ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    series: FloatArray,
    out: FloatArray,
    spreads: FloatArray,
) -> float:
    """Do what `innovations` does, and fill spreads (2, n) with their standard deviations, one where not measured."""
    if noise[4] == 0.0 and noise[5] == 0.0:
        return sea(steps, ok, a, k, noise, series, out, spreads)
    if noise[2] == 0.0:
        return sensors(steps, ok, noise, series, out, spreads)
    return both(steps, ok, a, k, noise, series, out, spreads)


def innovations(
    steps: FloatArray,
    ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    series: FloatArray,
    out: FloatArray,
) -> float:
    """Fill out (m, 2, n) with the standardised innovations of series (m, 2, n); return the sum of log variances.

    Samples not measured give zero. Once four steps in a row of equal length leave the gains as they are, they are kept
    until a sample is missing or the step changes.
    """
    return filtered(steps, ok, a, k, noise, series, out, np.empty((2, steps.shape[0] + 1)))
