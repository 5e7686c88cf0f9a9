"""A fin angle seen through a static map with corners, and the path behind it, compiled.

    delta = proportional d + beyond B(d) + jump sign(d) [|d| > edge] + one_sided |d| + square d^2
    B(d) = sign(d) (c(|d| - edge) - c(-edge)),   c(x) = (x + sqrt(x^2 + blend^2)) / 2,  max(x, 0) without a blend
B is the part of an angle beyond +/-edge, its corners rounded over `blend`, zero at zero. A dead zone, a stall and an uneven fin
are all of this. The mean over a piece of the path is that of the map's integral, exact across the corners.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fieldsid.effects._paths import STRAIGHT_RAD, through
from fieldsid.models.fin_path import FinPath
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit

Numbers = tuple[float, float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class StaticMap:
    """The numbers of a static map: edge, blend, jump in rad, square in 1/rad, shares of the angle the others."""

    proportional: float = 0.0
    beyond: float = 0.0
    edge: float = 0.0
    blend: float = 0.0
    jump: float = 0.0
    one_sided: float = 0.0
    square: float = 0.0

    def through(self, path: FinPath, steps: FloatArray) -> FinPath:
        """Return a path seen through the map; arrays (n-1,) rad and s."""
        numbers: Numbers = (
            float(self.proportional), float(self.beyond), float(self.edge), float(self.blend), float(self.jump),
            float(self.one_sided), float(self.square),
        )  # fmt: skip
        if path.first is None and (np.abs(path.end - path.start) <= STRAIGHT_RAD).all():
            held = np.empty(steps.size)
            fill_values(path.mean, numbers, held)
            return FinPath(held, held)
        return through(path, steps, lambda _lengths, start, end, out: fill_lines(start, end, numbers, out))


@inner
def corner(x: float, blend: float) -> tuple[float, float]:
    """Return max(x, 0), its corner rounded over about `blend` to either side, and an antiderivative of it."""
    if blend == 0.0:
        return max(x, 0.0), 0.5 * x * max(x, 0.0)
    root = math.hypot(x, blend)
    return 0.5 * (x + root), 0.25 * (x * x + x * root + blend * blend * math.asinh(x / blend))


@inner
def value(d: float, numbers: Numbers, rest: float) -> float:
    """Return the angle that the map makes of one, rad; `rest` is the corner's value at an angle of zero."""
    proportional, beyond, edge, blend, jump, one_sided, square = numbers
    size, side = abs(d), 0.0 if d == 0.0 else math.copysign(1.0, d)
    reach = size - edge
    bent = max(reach, 0.0) if blend == 0.0 else 0.5 * (reach + math.hypot(reach, blend))
    far = beyond * (bent - rest) + (jump if size > edge else 0.0)
    return proportional * d + side * far + one_sided * size + square * d * d


@inner
def value_and_area(d: float, numbers: Numbers, rest: float, rest_area: float) -> tuple[float, float]:
    """Return the same, and the integral of the map from zero, rad^2; `rest_area` is that of the corner at an angle of zero."""
    proportional, beyond, edge, blend, jump, one_sided, square = numbers
    size, side = abs(d), 0.0 if d == 0.0 else math.copysign(1.0, d)
    bent, bent_area = corner(size - edge, blend)
    far = beyond * (bent - rest) + (jump if size > edge else 0.0)
    far_area = bent_area - rest_area - rest * size
    whole = 0.5 * d * (proportional * d + one_sided * size) + square * d * d * d / 3.0
    return (
        proportional * d + side * far + one_sided * size + square * d * d,
        whole + beyond * far_area + jump * max(size - edge, 0.0),
    )


@jit
def fill_values(angles: FloatArray, numbers: Numbers, out: FloatArray) -> None:
    """Fill out (n,) with what the map makes of angles (n,) rad."""
    rest, _ = corner(-numbers[2], numbers[3])
    for i in range(angles.shape[0]):
        out[i] = value(angles[i], numbers, rest)


@jit
def fill_lines(start: FloatArray, end: FloatArray, numbers: Numbers, out: FloatArray) -> None:
    """Fill out (n, 4) with the line's start and end, and where the fin begins and ends, of straight pieces (n,) rad.

    A piece mostly begins where the one before ends, and a held one has one value: the square root and the logarithm of each
    angle are worked out once.
    """
    rest, rest_area = corner(-numbers[2], numbers[3])
    last_angle, last, last_area = math.nan, 0.0, 0.0
    for i in range(start.shape[0]):
        change = end[i] - start[i]
        if abs(change) > STRAIGHT_RAD:
            if start[i] != last_angle:
                last, last_area = value_and_area(start[i], numbers, rest, rest_area)
            first, first_area = last, last_area
            last_angle = end[i]
            last, last_area = value_and_area(last_angle, numbers, rest, rest_area)
            mean, half = (last_area - first_area) / change, 0.5 * (last - first)
            out[i, 0], out[i, 1], out[i, 2], out[i, 3] = mean - half, mean + half, first, last
        elif change == 0.0:
            held = last if start[i] == last_angle else value(start[i], numbers, rest)
            out[i, 0], out[i, 1], out[i, 2], out[i, 3] = held, held, held, held
        else:
            first, bent = value(start[i], numbers, rest), value(end[i], numbers, rest)
            mean, half = value(0.5 * (start[i] + end[i]), numbers, rest), 0.5 * (bent - first)
            out[i, 0], out[i, 1], out[i, 2], out[i, 3] = mean - half, mean + half, first, bent
