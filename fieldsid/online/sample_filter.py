"""Feed samples into the recursion, despite repeated time stamps, gaps, wrapped headings and restarts of the clock.

The filter of the recursion needs increasing time and signals without gaps. A short gap is bridged by linear interpolation, as in
the block estimate. After a long gap, or where the clock restarts, the filter starts again while the estimate is kept. Samples
enter two samples late, so that spikes can be detected, by the rule of `convert/faults/spikes.py` on a window.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import inf, isfinite, nan, remainder, tau
from typing import Any

import numpy as np

from fieldsid.fitting.regression.recursive_ls import (
    ANGLE,
    MEMORY,
    RATE,
    SAMPLES,
    TIME,
    H,
    forget_filter,
    initial_memory,
    step,
)
from fieldsid.fitting.regression.svf_equation import MAX_BRIDGED_GAP_S
from fieldsid.logs.convert.clock import SLOWER, Track, line_over_steps
from fieldsid.logs.convert.faults.spikes import ALIKE, spike_limit
from fieldsid.numerics.arrays import FloatArray
from fieldsid.online.lagged_rows import LaggedRows

SPIKE_WINDOW = 256
SPIKE_LIMIT_EVERY = SPIKE_WINDOW // 2
"""Samples from which the spike limit is estimated, and samples between two estimates."""


class SpikeGate:
    """Spike removal in one signal: `push` takes the newest value and returns that of two samples before, NaN for a spike."""

    STATE = __slots__ = ("_limit", "_recent", "_seen", "spikes")

    def __init__(self) -> None:
        self._recent, self._seen, self._limit, self.spikes = np.full(SPIKE_WINDOW, nan), 0, nan, 0

    def push(self, value: float) -> float:
        """Take a value, NaN where nothing was measured; return that of two samples before."""
        recent = self._recent
        recent[:-1] = recent[1:]
        recent[-1] = value
        self._seen += 1
        if self._seen % SPIKE_LIMIT_EVERY == 0:
            known = recent[np.isfinite(recent)]
            self._limit = spike_limit(known) if known.size >= SPIKE_LIMIT_EVERY else nan
        middle = float(recent[-3])
        if isfinite(self._limit) and self._is_spike(recent[-5:]):
            self.spikes += 1
            recent[-3] = nan
            return nan
        return middle

    def _is_spike(self, five: FloatArray) -> bool:
        a, b, c, d, e = (float(v) for v in five.tolist())
        if not isfinite(a + b + c + d + e):
            return False
        middle = c - 0.5 * (b + d)
        sign = 1.0 if middle > 0.0 else -1.0
        distances = (sign * (c - 2.0 * b + a), sign * middle, sign * (c - 2.0 * d + e))
        return min(distances) > max(self._limit, ALIKE * distances[1])


CLOCK_RESTART_S = 1.0
"""A time stamp at least this far before the last one means that the clock restarted; one less far is a late sample, which is left
out."""
DELAY_SAMPLES = 2
"""Samples that wait until it can be decided whether they are spikes."""
MOST_MOVES = 64
"""Most fin positions within a bridged gap; a gap with more counts as a long one."""


Line = tuple[float, float]
"""Start and end, in rad, of the line that the fin follows from the previous sample to this one, NaN where it is not known."""
NO_LINE = (nan, nan)


class SampleFilter:
    """The state of the filter `memory`, Theta and P in `packed`, the rows' lagged products `lagged`, the `counts` of faults."""

    STATE = ("memory", "packed", "_late", "_moves", "_fin", "_last_angle", "counts", "lagged", "angle_gate", "rate_gate")
    __slots__ = ("_order", "_row", "_sample", "_settings", "_stiff", *STATE)

    def __init__(self, *, stiff: bool, by_rate: bool, bandwidth: float, forgetting: float) -> None:
        self.memory, self.packed = np.zeros(MEMORY), initial_memory(stiff=stiff)
        self._order = 1 if by_rate else 2
        self._stiff = stiff
        self._settings = (bandwidth, forgetting, self._order)
        self._sample, self._row = np.zeros((1, 6)), np.zeros((1, 5))
        self.lagged = LaggedRows(bandwidth, forgetting, stiff=stiff)
        self.angle_gate, self.rate_gate = SpikeGate(), SpikeGate()
        self._late: list[tuple[float, float, bool, Line]] = []
        self._moves: list[tuple[float, float, Line]] = []
        self._fin, self._last_angle = nan, nan
        self.counts = {"used": 0, "missing": 0, "repeated": 0, "gaps": 0, "restarts": 0, "late": 0}

    def push(self, time: float, fin: float, angle: float, rate: float, *, is_held: bool, line: Line | None = None) -> bool:
        """Take one sample and return whether a row joined the estimate.

        Since the last sample the fin was constant (`is_held`), or moved linearly to `fin`, or followed `line`.
        """
        if not isfinite(time):
            self.counts["missing"] += 1
            return False
        last = self._late[-1][0] if self._late else -inf
        if time <= last:
            if time > last - CLOCK_RESTART_S:
                self.counts["repeated" if time == last else "late"] += 1
                return False
            self.begin_again()
            self.counts["restarts"] += 1
        self._late.append((time, fin, is_held, line or NO_LINE))
        unwrapped = self._unwrapped(angle)
        ready = self.angle_gate.push(unwrapped), self.rate_gate.push(rate)
        if len(self._late) <= DELAY_SAMPLES:
            return False
        time, fin, is_held, line = self._late.pop(0)
        return self._take(time, fin, *ready, is_held=is_held, line=line)

    def begin_again(self) -> None:
        """Restart the filter at the next sample; the estimate and its errors stay."""
        forget_filter(self.memory)
        self._late.clear()
        self._moves.clear()
        self._fin = nan

    @property
    def time(self) -> float:
        """Stamp of the newest sample in s, NaN before the first."""
        return self._late[-1][0] if self._late else nan

    @property
    def newest_angle(self) -> float:
        """The newest measured angle in rad, a heading unwrapped."""
        return self._last_angle

    @property
    def row(self) -> FloatArray:
        """The newest row (5,) of phi and target."""
        row: FloatArray = self._row[0]
        return row

    @property
    def row_time(self) -> float:
        """Stamp in s of the newest row."""
        return float(self.memory[TIME])

    def continue_from(self, other: SampleFilter) -> None:
        """Continue from another filter: take its unwrapped heading, spike limits and counts, except the count of rows used."""
        self._last_angle, self.angle_gate, self.rate_gate = other.newest_angle, other.angle_gate, other.rate_gate
        self.counts = {**other.counts, "used": self.counts["used"]}

    def _unwrapped(self, angle: float) -> float:
        if not isfinite(angle):
            return angle
        if not self._stiff and isfinite(self._last_angle):
            angle = self._last_angle + remainder(angle - self._last_angle, tau)
        self._last_angle = angle
        return angle

    def _take(self, time: float, fin: float, angle: float, rate: float, *, is_held: bool, line: Line) -> bool:
        memory = self.memory
        fin = fin if isfinite(fin) else self._moves[-1][1] if self._moves else self._fin
        if not isfinite(fin):
            self.counts["missing"] += 1
            return False
        if not isfinite(rate if self._order == 1 else angle):
            self.counts["missing"] += 1
            if len(self._moves) <= MOST_MOVES:
                self._moves.append((time, fin, line))
            return False
        if memory[SAMPLES] and (time - memory[TIME] > MAX_BRIDGED_GAP_S or len(self._moves) > MOST_MOVES):
            self.counts["gaps"] += 1
            forget_filter(memory)
            self._moves.clear()
        angle = self._angle(time, angle, rate)
        rate = rate if isfinite(rate) else 0.0
        used = self._through_moves(time, fin, angle, rate, is_held=is_held, line=line)
        self._fin = fin
        return used

    def _angle(self, time: float, angle: float, rate: float) -> float:
        """Return the angle; where none was measured, the last one plus the integral of the rate."""
        memory = self.memory
        if isfinite(angle):
            return angle
        if not memory[SAMPLES]:
            return 0.0
        return float(memory[ANGLE] + 0.5 * (rate + memory[RATE]) * (time - memory[TIME]))

    def _through_moves(self, time: float, fin: float, angle: float, rate: float, *, is_held: bool, line: Line) -> bool:
        """Step to a measured sample through the moves of the fin since the last measured sample.

        Within a usual step the moves are replaced by one line of the fin. Where samples are missing, there is one step for each
        move, with angle and rate interpolated linearly.
        """
        memory, moves = self.memory, self._moves
        if memory[SAMPLES] and moves and not isfinite(line[0]) and time - memory[TIME] <= SLOWER * memory[H]:
            line = self._line_of_moves(time, fin, is_held=is_held)
            self.counts["missing"] -= len(moves)
        elif memory[SAMPLES] and moves:
            begin, angle0, rate0 = float(memory[TIME]), float(memory[ANGLE]), float(memory[RATE])
            for at, then, along in moves:
                share = (at - begin) / (time - begin)
                straight = angle0 + share * (angle - angle0), rate0 + share * (rate - rate0)
                self._step(at, self._known_line(along, then, is_held=is_held), *straight, counts=False)
                self._fin = then
        moves.clear()
        return self._step(time, self._known_line(line, fin, is_held=is_held), angle, rate, counts=True)

    def _line_of_moves(self, time: float, fin: float, *, is_held: bool) -> Line:
        """Return the line of the fin over the step to a sample: a fin that is logged in messages alone moves between samples."""
        begin = float(self.memory[TIME])
        track = [(begin, self._fin), *((at, then) for at, then, _ in self._moves), *([] if is_held else [(time, fin)])]
        found = line_over_steps(Track(*np.array(track).T), np.array([begin, time]), inf, is_held=is_held)
        return NO_LINE if found is None else (float(found[0, 0]), float(found[1, 0]))

    def _known_line(self, line: Line, fin: float, *, is_held: bool) -> Line:
        """Return a line, or where it is not known that of a fin that was constant (`is_held`), or moved linearly to `fin`."""
        if isfinite(line[0]):
            return line
        before = self._fin if isfinite(self._fin) else fin
        return before, before if is_held else fin

    def _step(self, time: float, line: Line, angle: float, rate: float, *, counts: bool) -> bool:
        self._sample[0] = time, *line, angle, rate, float(counts)
        if not step(self.memory, self.packed, *self._settings, self._sample, self._row, 0):
            return False
        self.counts["used"] += 1
        self.lagged.add(time, self._row[0])
        return True


def check_times(state: Mapping[str, Any]) -> None:
    """Raise ValueError where the times of a state do not increase: the filter divides by their differences."""
    begin = float(state["memory"][TIME]) if state["memory"][SAMPLES] else -inf
    moves, late = ([float(row[0]) for row in state[k]] for k in ("moves", "late"))
    if len(late) > DELAY_SAMPLES or len(moves) > MOST_MOVES + 1:
        raise ValueError(f"{len(late)} samples and {len(moves)} moves of the fin that wait")
    if any(b <= a for a, b in pairwise([begin, *moves, *late])):
        raise ValueError("times that do not go on")
