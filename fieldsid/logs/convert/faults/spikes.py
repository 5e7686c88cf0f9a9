"""Find spikes: single samples off the lines through the two neighbours before, the two after, and the one on each side.

A spike is on the same side of all three lines, by more than a limit and by about as much of each. A step of the signal, a kink,
and the peak of a fast response lie on one of the lines, so that at least one of the three distances is small or of the other
sign: small beside the others, since a log without noise has a limit below the curvature of its motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.logs.few_of import FEW
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.white_noise import MEDIAN_OF_NORMAL

SPREADS = 8.0
"""Limit of the three distances in standard deviations of the signal's noise."""
OF_MEDIAN = 1.0 / (MEDIAN_OF_NORMAL * math.sqrt(1.5))
"""Ratio of the standard deviation of white noise to the median distance of its samples from the mean of their neighbours."""
ALIKE = 0.5
"""Least ratio of the distances from the lines on either side to that from the line across, which are equal for a lone sample."""
DIGITS = 3.0
"""Limit of the three distances in units of the log's last digit."""
SPARSE = 0.01
"""Largest share of spikes among the samples; where there are more, they belong to the signal."""
FEWEST = 20
ROUNDED = 1e-9
"""Share of a signal's range, but for FEW values at either end, below which differences are rounding."""


@dataclass(frozen=True, slots=True)
class Spikes:
    """Indices (k,) of the spikes of a signal, their distance (k,) from the line between their neighbours, and the limit."""

    places: npt.NDArray[np.intp]
    off: FloatArray
    limit: float


# a damaged log may hold numbers whose differences overflow or are NaN
@np.errstate(over="ignore", invalid="ignore")
def spikes_of(values: FloatArray) -> Spikes:
    """Return the spikes of a signal (n,) without gaps; none where it is short, or where there are more than a few."""
    none = Spikes(np.zeros(0, dtype=np.intp), np.zeros(0), float("inf"))
    if values.size < FEWEST:
        return none
    bend, limit = np.diff(values, 2), spike_limit(values)
    if not np.isfinite(limit):
        return none
    before, middle, after = bend[:-2], -0.5 * bend[1:-1], bend[2:]
    sign, across = np.sign(middle), np.minimum(np.abs(middle), np.finfo(np.float64).max)
    alone = np.minimum(np.minimum(before * sign, after * sign), across) > np.maximum(limit, ALIKE * across)
    places = np.flatnonzero(alone)
    if places.size > max(SPARSE * values.size, 1.0):
        return none
    return Spikes(places + 2, np.abs(middle[places]), limit)


@np.errstate(over="ignore", invalid="ignore")
def spike_limit(values: FloatArray) -> float:
    """Return the distance from all three lines beyond which a sample of a signal (n,) is a spike; inf for a straight line."""
    bend = np.abs(np.diff(values, 2))
    usual = float(np.median(bend)) or float(np.mean(bend))
    return max(SPREADS * OF_MEDIAN * 0.5 * usual, DIGITS * last_digit(values)) if usual else float("inf")


def last_digit(values: FloatArray) -> float:
    """Return the least difference of two different values, which is the last digit of a log with few digits."""
    ordered, ends = np.sort(values), int(FEW * values.size)
    apart = np.diff(ordered)
    different = apart[apart > ROUNDED * (ordered[-1 - ends] - ordered[ends])]
    return float(different.min()) if different.size else 0.0
