"""Find the repeats of a sensor that is slower than the rows of its table; a repeated number is no new measurement.

If the repeats were fitted as measurements, the signal would be late by half a step of the sensor, and the noise of each
measurement would be counted several times.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

FEWEST = 10
"""Smallest number of changes from which the sensor's interval is estimated."""


def without_repeats(name: str, values: FloatArray) -> tuple[FloatArray, list[Note]]:
    """Return a signal (n,) with the repeats of its slower sensor as NaN, and a note; unchanged where it has none."""
    seen = np.flatnonzero(np.isfinite(values))
    changed = np.flatnonzero(np.diff(values[seen]) != 0.0)
    every = _rows_per_measurement(changed)
    if every == 1:
        return values, []
    measured = np.full(values.shape, np.nan)
    fresh = seen[(changed[0] + 1) % every :: every]
    measured[fresh] = values[fresh]
    message = (
        f"{name} changes at every {every}th sample only ({changed.size} times): it was taken at a lower rate, and repeated until "
        "the next; the repeats are missing now"
    )
    return measured, [Note("repeated", message, {"signal": name, "value": every, "count": changed.size})]


def _rows_per_measurement(changed: npt.NDArray[np.intp]) -> int:
    """Return the number of rows per measurement, by the indices (k,) before each change; 1 where it is not constant.

    k changes fall on multiples of m rows by chance with the probability m^(1-k), which is negligible for ten. Two equal
    measurements in succession give an interval of 2 m rows, so that m is the greatest common divisor of the intervals.
    """
    if changed.size < FEWEST:
        return 1
    apart = np.diff(changed)
    every = int(np.gcd.reduce(apart))
    return every if every == int(np.median(apart)) else 1
