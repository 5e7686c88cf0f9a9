"""Straight lines that stand for a bent fin path over one interval: exact mean, and the slope nearest in the mean square.

The area under the path moves the hull, so the mean is kept exactly; start and end may overshoot the path a little.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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


def bend(x: FloatArray, blend: float) -> FloatArray:
    """Return max(x, 0), its corner rounded over about `blend` to either side: (x + sqrt(x^2 + blend^2)) / 2."""
    if blend == 0.0:
        return np.maximum(x, 0.0)
    return np.asarray(0.5 * (x + np.hypot(x, blend)))


def area_of_bend(x: FloatArray, blend: float) -> FloatArray:
    """Return an antiderivative of `bend`."""
    if blend == 0.0:
        return np.asarray(0.5 * x * np.maximum(x, 0.0))
    return np.asarray(0.25 * (x * x + x * np.hypot(x, blend) + blend**2 * np.arcsinh(x / blend)))


@dataclass(frozen=True, slots=True)
class Beyond:
    """The part of an angle d beyond +/-edge, sign(d) max(|d| - edge, 0), its corners rounded over `blend`; zero at zero."""

    edge: float
    blend: float

    def value(self, d: FloatArray) -> FloatArray:
        """Return the part beyond, (n,) rad."""
        at_zero = bend(np.array(-self.edge), self.blend)
        return np.asarray(np.sign(d) * (bend(np.abs(d) - self.edge, self.blend) - at_zero))

    def area(self, d: FloatArray) -> FloatArray:
        """Return its integral from zero, (n,) rad^2."""
        zero, size = np.array(-self.edge), np.abs(d)
        return np.asarray(
            area_of_bend(size - self.edge, self.blend) - area_of_bend(zero, self.blend) - bend(zero, self.blend) * size
        )


def through_map(path: FinPath, value: Map, area: Map) -> FinPath:
    """Return a path seen through a static map d -> value(d), with area(d) the integral of value from 0 to d.

    The mean over an interval is (area(end) - area(start)) / (end - start), exact across kinks. Arrays (n-1,) rad.
    """
    change = path.end - path.start
    moves = np.abs(change) > STRAIGHT_RAD
    if not moves.any():
        held = value(path.mean)
        return FinPath(held, held)
    safe = np.where(moves, change, 1.0)
    mean = np.where(moves, (area(path.end) - area(path.start)) / safe, value(path.mean))
    half = 0.5 * (value(path.end) - value(path.start))
    return FinPath(mean - half, mean + half)
