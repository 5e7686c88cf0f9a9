"""Paths of the fin through a chain of actuator effects: one line an interval for the hull, straight pieces for the next effect.

The hull responds to the area under the path. A line therefore has the path's exact mean and first moment; where the path bends
or jumps, the ends of the line lie outside the path. The next actuator effect must not see these ends: a play would remember
angles that the fin never had, and a stall would respond to them. For it the path is rebuilt from its ends, mean and first
moment as constant, linear, constant, which is exact for a delay, a rate limit or a play between two zero-order-hold commands,
or as two lines with a corner, which approximates a lag.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldsid.models.fin_path import FinPath
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit

Part = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], object]
"""An actuator effect (steps, start, end, out): fills out (k, 4) with start and end of the lines, first and last fin angle."""
STRAIGHT_RAD = 1e-6
"""Change of the angle over an interval below which a map is linearised; the mean is then wrong by less than 1e-7 rad."""
PASSED_RAD = 5e-5
"""By how much a line's ends may lie outside the fin's path and the line still serve as the path: the error of a play's edge."""
BRIEF = 1e-6
"""Share of an interval below which a piece is left out."""


def through(path: FinPath, steps: FloatArray, part: Part) -> FinPath:
    """Return the path behind an actuator effect, which is applied to straight pieces of the path with their lengths in s."""
    lines = _table(steps.size)
    if path.first is None or path.last is None:
        part(steps, path.start, path.end, lines)
        return FinPath(*lines.T)
    pieces = _table(3 * steps.size)
    count = split(steps, path.start, path.end, path.first, path.last, pieces)
    length, start, end, _ = pieces[:count].T
    out = _table(count)
    part(length, start, end, out)
    join(count, pieces, out, lines)
    return FinPath(*lines.T)


def _table(rows: int) -> FloatArray:
    """Return an empty array (rows, 4) with contiguous columns, so that a column can be read without a copy."""
    return np.empty((rows, 4), order="F")


@jit
def split(
    steps: FloatArray, start: FloatArray, end: FloatArray, first: FloatArray, last: FloatArray, out: FloatArray
) -> int:  # fmt: skip
    """Fill out with length, start, end and interval of the pieces of a path, at most three an interval; return their number.

    Units: the interval, and the change from `first` to `last`. A path that is 0 until c - w/2, rises linearly to 1 at c + w/2 and
    stays has the mean 1 - c and the first moment c (1 - c) / 2 - w^2 / 24 about the middle. Where the w of a given moment exceeds
    2 min(c, 1 - c), two lines from 0 to s + e at the share s and on to 1, with e = 1 - 2 c, have the moment (1 + e (2 s - 1)) /
    12. A path that turns back has no such c: its line serves as the path, as it does where its ends agree with `first` and
    `last`.
    """
    k = 0
    for i in range(steps.shape[0]):
        change = last[i] - first[i]
        centre = 2.0
        if abs(start[i] - first[i]) + abs(end[i] - last[i]) > PASSED_RAD and abs(change) > STRAIGHT_RAD:
            centre = (last[i] - 0.5 * (start[i] + end[i])) / change
        if centre < -BRIEF or centre > 1.0 + BRIEF:
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = steps[i], start[i], end[i], i
            k += 1
            continue
        centre = min(max(centre, 0.0), 1.0)
        slope = (end[i] - start[i]) / change
        square, room = 12.0 * centre * (1.0 - centre) - 2.0 * slope, 2.0 * min(centre, 1.0 - centre)
        if square > room * room:
            excess = 1.0 - 2.0 * centre
            low, high = max(0.0, -excess), min(1.0, 1.0 - excess)
            leaves = arrives = min(max(0.5 + 0.5 * (slope - 1.0) / excess, low), high) if excess != 0.0 else 0.0
            before = after = first[i] + (leaves + excess) * change
        else:
            width = np.sqrt(square) if square > BRIEF * BRIEF else 0.0
            leaves, arrives = centre - 0.5 * width, centre + 0.5 * width
            before, after = first[i], last[i]
        if leaves > BRIEF:
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = leaves * steps[i], first[i], before, i
            k += 1
        if arrives - leaves > BRIEF:
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = (arrives - leaves) * steps[i], before, after, i
            k += 1
        if arrives < 1.0 - BRIEF:
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = (1.0 - arrives) * steps[i], after, last[i], i
            k += 1
    return k


@jit
def join(count: int, pieces: FloatArray, lines: FloatArray, out: FloatArray) -> None:
    """Fill out (n-1, 4) with the line of each interval and its first and last fin angle, from the lines of the pieces (k, 4)."""
    k = 0
    while k < count:
        i = int(pieces[k, 3])
        begins, length, area = k, 0.0, 0.0
        while k < count and pieces[k, 3] == i:
            length += pieces[k, 0]
            area += 0.5 * pieces[k, 0] * (lines[k, 0] + lines[k, 1])
            k += 1
        moment, at = 0.0, -0.5 * length
        for j in range(begins, k):
            h = pieces[j, 0]
            moment += 0.5 * h * (lines[j, 0] + lines[j, 1]) * (at + 0.5 * h) + h * h * (lines[j, 1] - lines[j, 0]) / 12.0
            at += h
        mean, half = area / length, 6.0 * moment / (length * length)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = mean - half, mean + half, lines[begins, 2], lines[k - 1, 3]


@inner
def line_of_two_pieces(bend: float, first: float, middle: float, last: float) -> tuple[float, float]:
    """Return start and end of the line for a path first -> middle -> last with a corner at the share `bend` in 0..1.

    The path is the chord and a triangle of height e; the projection of the triangle adds e (1 - bend) and e bend to the ends.
    """
    excess = middle - (first + (last - first) * bend)
    return first + excess * (1.0 - bend), last + excess * bend
