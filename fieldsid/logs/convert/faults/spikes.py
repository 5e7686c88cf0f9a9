"""Samples that stand alone: a sensor's spike is off the lines through its neighbours on either side and between them.

With e the distance from each of these three lines, a spike has all three on one side and beyond a limit. A step of the signal,
a kink and the peak of a fast answer are on one of the lines, so that at least one of the three is small or of the other sign.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.white_noise import MEDIAN_OF_NORMAL

SPREADS = 8.0
"""Standard deviations of the signal's own noise that all three distances exceed."""
OF_MEDIAN = 1.0 / (MEDIAN_OF_NORMAL * math.sqrt(1.5))
"""Standard deviation of white noise over the median distance of its samples from the middle of their neighbours."""
DIGITS = 3.0
"""Steps of the log's last digit that they exceed."""
FEW = 0.01
"""Share of the samples up to which spikes are a sensor's fault, and beyond which they are the signal."""
FEWEST = 20
ROUNDED, BULK = 1e-9, 0.05
"""Share of a signal's range below which values differ by rounding only; share left out of that range at either end."""


@dataclass(frozen=True, slots=True)
class Spikes:
    """Places (k,) of the spikes of a signal, their distance (k,) from the line between their neighbours, and the limit."""

    places: npt.NDArray[np.intp]
    off: FloatArray
    limit: float


# a damaged log holds numbers whose differences are none
@np.errstate(over="ignore", invalid="ignore")
def spikes_of(values: FloatArray) -> Spikes:
    """Return the spikes of a signal (n,) without gaps; none where it is short, or where they are more than a few."""
    none = Spikes(np.zeros(0, dtype=np.intp), np.zeros(0), float("inf"))
    if values.size < FEWEST:
        return none
    bend, limit = np.diff(values, 2), spike_limit(values)
    if not np.isfinite(limit):
        return none
    before, middle, after = bend[:-2], -0.5 * bend[1:-1], bend[2:]
    sign = np.sign(middle)
    alone = np.minimum(np.minimum(before * sign, after * sign), np.abs(middle)) > limit
    places = np.flatnonzero(alone)
    if places.size > max(FEW * values.size, 1.0):
        return none
    return Spikes(places + 2, np.abs(middle[places]), limit)


@np.errstate(over="ignore", invalid="ignore")
def spike_limit(values: FloatArray) -> float:
    """Return the distance from all three lines beyond which a sample of a signal (n,) is a spike; inf where it never bends."""
    bend = np.abs(np.diff(values, 2))
    usual = float(np.median(bend)) or float(np.mean(bend))
    return max(SPREADS * OF_MEDIAN * 0.5 * usual, DIGITS * last_digit(values)) if usual else float("inf")


def last_digit(values: FloatArray) -> float:
    """Return the least difference of two values that differ: the last digit of a log that has few."""
    ordered, ends = np.sort(values), int(BULK * values.size)
    apart = np.diff(ordered)
    told = apart[apart > ROUNDED * (ordered[-1 - ends] - ordered[ends])]
    return float(told.min()) if told.size else 0.0
