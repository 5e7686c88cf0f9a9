"""Paths through the fin's gear, interval by interval: straight lines for the hull, the pieces behind them for the gear.

The area under the path moves the hull, so a line has the path's exact mean and, as slope, its first moment; where the path
bends or jumps the line's ends pass it. The next part of the gear must not see that: a play would remember angles that never
were, a stall answer to them. It sees the path rebuilt from its ends, mean and moment: held, straight and held again, which
a delayed, a limited, a freed fin is exactly between two held commands, or straight, bent and straight, as a lagged one nearly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldsid.models.fin_path import FinPath
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit

Part = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], object]
"""(steps, start, end, out): fills out (k, 4) with a line's start and end, and where the fin itself begins and ends."""
STRAIGHT_RAD = 1e-6
"""Below this change over an interval a map is taken as straight; the mean is then wrong by less than 1e-7 rad."""
PASSED_RAD = 5e-5
"""By how much a line may pass the fin's own ends and still be taken for its path: it moves a play or a kink's edge by that."""
BRIEF = 1e-6
"""Share of an interval below which a piece of it is none."""


def through(path: FinPath, steps: FloatArray, part: Part) -> FinPath:
    """Return a path seen through a part of the gear, which is given straight pieces of it with their lengths in s."""
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
    """Return room for a table (rows, 4), each of its columns in one piece: what reads one later need not copy it."""
    return np.empty((rows, 4), order="F")


@jit
def split(
    steps: FloatArray, start: FloatArray, end: FloatArray, first: FloatArray, last: FloatArray, out: FloatArray
) -> int:  # fmt: skip
    """Fill out with length, start, end and interval of the pieces of a path, at most three an interval; return their number.

    In shares of the interval and of the change from `first` to `last`: held at 0 up to c - w/2, straight to 1 at c + w/2 and
    held has the mean 1 - c and the moment c (1 - c) / 2 - w^2 / 24 about the middle. Where that w does not fit beside c,
    straight to s + e at the share s and on to 1, e = 1 - 2 c, has the moment (1 + e (2 s - 1)) / 12. A path that comes back,
    for which there is no such c, is left as its line, and so is one that next to keeps to it.
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
    """Fill out (n-1, 4) with the line of each interval, and where the fin begins and ends, from those of the pieces (k, 4)."""
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
    """Return start and end of the line for a path first -> middle -> last that bends at the share `bend` in 0..1.

    The bend is a triangle of height e over the chord; its projection adds e (1 - bend) and e bend to the ends.
    """
    excess = middle - (first + (last - first) * bend)
    return first + excess * (1.0 - bend), last + excess * bend
