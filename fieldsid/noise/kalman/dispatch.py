"""The Kalman filter of the motion that disturbances and coloured sensor noise cause: which of three a noise asks for.

State (y, p, w, n_y, n_p), see noise/whiten.py; a noise is a vector (7,) in the order of whitening.NOISE_FIELDS. What is
zero for good is left out, and each filter is compiled only once it is asked for.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.noise.kalman.disturbance import disturbance_filter
from fieldsid.noise.kalman.full import full_filter
from fieldsid.noise.kalman.sensor_colour import sensor_colour_filter
from fieldsid.numerics.arrays import FloatArray


def kalman_filter(
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
        return disturbance_filter(steps, ok, a, k, noise, series, out, spreads)
    if noise[2] == 0.0:
        return sensor_colour_filter(steps, ok, noise, series, out, spreads)
    return full_filter(steps, ok, a, k, noise, series, out, spreads)


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
    return kalman_filter(steps, ok, a, k, noise, series, out, np.empty((2, steps.shape[0] + 1)))
