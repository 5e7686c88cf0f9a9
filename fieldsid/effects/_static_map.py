"""A static map of the fin angle with corners, and the fin's path behind it, compiled.

    delta = proportional d + beyond B(d) + jump sign(d) [|d| > edge] + one_sided |d| + square d^2
    B(d) = sign(d) (c(|d| - edge) - c(-edge)),   c(x) = (x + sqrt(x^2 + blend^2)) / 2,  max(x, 0) without a blend
B is the part of an angle beyond +/-edge, with corners rounded over `blend`, and zero at zero. A dead zone, a stall and a fin with
unequal sides are such maps. The mean over a piece of the path comes from the integral of the map: it is exact across the corners.
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
    """The numbers of a static map: edge, blend and jump in rad, square in 1/rad, all others without unit."""

    proportional: float = 0.0
    beyond: float = 0.0
    edge: float = 0.0
    blend: float = 0.0
    jump: float = 0.0
    one_sided: float = 0.0
    square: float = 0.0

    def through(self, path: FinPath, steps: FloatArray) -> FinPath:
        """Return the path behind the map; steps (n-1,) s."""
        numbers: Numbers = (
            float(self.proportional), float(self.beyond), float(self.edge), float(self.blend), float(self.jump),
            float(self.one_sided), float(self.square),
        )  # fmt: skip
        if path.first is None and (np.abs(path.end - path.start) <= STRAIGHT_RAD).all():
            angles = np.empty(steps.size)
            fill_values(path.mean, numbers, angles)
            return FinPath(angles, angles)
        return through(path, steps, lambda _lengths, start, end, out: fill_lines(start, end, numbers, out))


@inner
def root_of(x: float, blend: float) -> float:
    """Return the root in the corner c(x) = (x + root) / 2, which is rounded over about `blend` to either side."""
    return abs(x) if blend == 0.0 else math.hypot(x, blend)


@inner
def corner_area(x: float, root: float, blend: float) -> float:
    """Return an antiderivative of the corner c at x, with its root there."""
    rounded = 0.0 if blend == 0.0 else blend * blend * math.asinh(x / blend)
    return 0.25 * (x * x + x * root + rounded)


@inner
def value(d: float, root: float, numbers: Numbers, rest: float) -> float:
    """Return the map at the angle d, rad; `root` is the corner's root at |d| - edge, `rest` the corner at an angle of zero."""
    proportional, beyond, edge, _, jump, one_sided, square = numbers
    size, side = abs(d), 0.0 if d == 0.0 else math.copysign(1.0, d)
    far = beyond * (0.5 * (size - edge + root) - rest) + (jump if size > edge else 0.0)
    return proportional * d + side * far + one_sided * size + square * d * d


@inner
def value_at(d: float, numbers: Numbers, rest: float) -> float:
    """Return the map at the angle d, rad; `rest` is the corner at an angle of zero."""
    return value(d, root_of(abs(d) - numbers[2], numbers[3]), numbers, rest)


@inner
def value_and_area(d: float, numbers: Numbers, rest: float, rest_area: float) -> tuple[float, float]:
    """Return the map at the angle d and its integral from zero, rad^2; `rest_area` is the corner's antiderivative at zero."""
    proportional, beyond, edge, blend, jump, one_sided, square = numbers
    size = abs(d)
    root = root_of(size - edge, blend)
    far = corner_area(size - edge, root, blend) - rest_area - rest * size
    smooth = 0.5 * d * (proportional * d + one_sided * size) + square * d * d * d / 3.0
    return value(d, root, numbers, rest), smooth + beyond * far + jump * max(size - edge, 0.0)


@inner
def at_rest(numbers: Numbers) -> tuple[float, float]:
    """Return the corner at an angle of zero, and its antiderivative."""
    edge, blend = numbers[2], numbers[3]
    root = root_of(-edge, blend)
    return 0.5 * (root - edge), corner_area(-edge, root, blend)


@jit
def fill_values(angles: FloatArray, numbers: Numbers, out: FloatArray) -> None:
    """Fill out (n,) with the map at angles (n,) rad."""
    rest, _ = at_rest(numbers)
    for i in range(angles.shape[0]):
        out[i] = value_at(angles[i], numbers, rest)


@jit
def fill_lines(start: FloatArray, end: FloatArray, numbers: Numbers, out: FloatArray) -> None:
    """Fill out (n, 4) with start and end of the lines and the first and last fin angle, for straight pieces (n,) in rad.

    A piece mostly begins where the previous one ends, and a constant one has one value, so that the square root and the
    logarithm of each angle are computed once.
    """
    rest, rest_area = at_rest(numbers)
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
            constant = last if start[i] == last_angle else value_at(start[i], numbers, rest)
            out[i, 0], out[i, 1], out[i, 2], out[i, 3] = constant, constant, constant, constant
        else:
            first, bent = value_at(start[i], numbers, rest), value_at(end[i], numbers, rest)
            mean, half = value_at(0.5 * (start[i] + end[i]), numbers, rest), 0.5 * (bent - first)
            out[i, 0], out[i, 1], out[i, 2], out[i, 3] = mean - half, mean + half, first, bent
