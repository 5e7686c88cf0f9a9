"""Straight lines that stand for a bent fin path over one interval: exact mean, and the slope nearest in the mean square.

The area under the path moves the hull, so the mean is kept exactly; start and end may overshoot the path a little.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import FinPath
from fieldsid.models.jit import jit

Map = Callable[[FloatArray], FloatArray]
STRAIGHT_RAD = 1e-6
"""Below this change over an interval a map is taken as straight; the mean is then wrong by less than 1e-7 rad."""


@jit
def line_of_two_pieces(bend: float, first: float, middle: float, last: float) -> tuple[float, float]:
    """Return start and end of the line for a path first -> middle -> last that bends at the share `bend` in 0..1.

    The bend is a triangle of height e over the chord; its projection adds e (1 - bend) and e bend to the ends.
    """
    excess = middle - (first + (last - first) * bend)
    return first + excess * (1.0 - bend), last + excess * bend


def through_map(path: FinPath, value: Map, area: Map) -> FinPath:
    """Return a path seen through a static map d -> value(d), with area(d) the integral of value from 0 to d.

    The mean over an interval is (area(end) - area(start)) / (end - start), exact across kinks. Arrays (n-1,) rad.
    """
    change = path.end - path.start
    moves = np.abs(change) > STRAIGHT_RAD
    safe = np.where(moves, change, 1.0)
    mean = np.where(moves, (area(path.end) - area(path.start)) / safe, value(path.mean))
    half = 0.5 * (value(path.end) - value(path.start))
    return FinPath(mean - half, mean + half)
