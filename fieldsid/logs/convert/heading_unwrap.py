"""A heading that was interpolated across its wrap, mended before it is unwrapped.

A logger that brings a wrapped heading to its own rate draws a straight line from one end of the range to the other,
the long way round: 3.13, 0.00, -3.13. Its samples are true - 2 pi s, s the share of the way, which the log does not
tell, so they are lost. They are known by their neighbours: the step over them is the motion, a turn apart, and each
step among them is faster than a vehicle turns. The motion is that of the measured rate where it agrees with the
heading, else that of the steps around. Where the range ends does not matter.

A heading held at the wrap also goes there and back (3.14, 0.01, 0.00, 3.14): then the step over the lost samples is
no turn apart, and they are told from a spike by both ends of the range beside them.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.clock import GAP_FACTOR, Track, straight
from fieldsid.logs.convert.frames import unwrapped
from fieldsid.logs.few_of import few_of
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.trapezoid import trapezoid_integral
from fieldsid.numerics.white_noise import robust_white_noise_std

FASTEST_RAD_S = 3.0
"""A step faster than this is no motion; a way round that takes longer than a turn at it is a real one."""
SLACK_RAD_S = 0.5
"""How far the rate at a crossing may be from that of the steps around it."""
MIN_JUMP_RAD = 0.03
NOISES = 6.0
"""What stands out is more than this many standard deviations of the noise, and more than `MIN_JUMP_RAD`."""
NEIGHBOURS = 8
"""Steps on each side that say what the motion is."""
HELD_S = 1.0
"""A heading held at the wrap comes back to it within this time."""
ALIKE = (0.7, 1.4)
"""Ratios of what two sensors say of one motion between which they agree: the next unit is further off."""
RARE = 0.02
"""Share of samples that bend, below which they tell no noise."""


def unwrapped_over(heading: Track, rate: Track | None = None, gap_factor: float = GAP_FACTOR) -> tuple[Track, list[Note]]:
    """Return a heading (n,) in rad without jumps of a turn, and a note where samples were interpolated across its wrap.

    Those samples come to lie straight between their neighbours, or are NaN where these are further apart than
    `gap_factor` median periods. All others keep their value up to whole turns.
    """
    lost = _interpolated(heading, rate)
    values = unwrapped(np.where(lost, np.nan, heading.values))
    if not lost.any():
        return Track(heading.time, values, heading.label), []
    values[lost] = straight(Track(heading.time, values), heading.time[lost], gap_factor)
    return Track(heading.time, values, heading.label), [_note(heading.time[lost], int(np.isnan(values[lost]).sum()))]


def _note(times: FloatArray, missing: int) -> Note:
    places = few_of([f"{t:.2f}" for t in times])
    samples = "1 sample was" if times.size == 1 else f"{times.size} samples were"
    now = "now missing" if missing == times.size else "now between their neighbours"
    if 0 < missing < times.size:
        now += f", {missing} of them missing"
    message = (
        f"yaw_rad: {samples} interpolated the long way round where the heading wraps, at {places} s ({now}); "
        "log the heading unwrapped, or at its own rate"
    )
    data = {"signal": "yaw_rad", "value": int(times.size), "limit": 0, "missing": missing, "times_s": [float(t) for t in times]}
    return Note("wrap_interpolated", message, data)


def _interpolated(heading: Track, rate: Track | None) -> npt.NDArray[np.bool_]:
    """Return which samples (n,) are a line across the wrap."""
    lost = np.zeros(heading.values.size, dtype=bool)
    seen = np.flatnonzero(np.isfinite(heading.values))
    # Garbage in a damaged log may be near the largest float; what overflows then is no turn.
    with np.errstate(over="ignore", invalid="ignore"):
        path = _path(heading.time[seen], heading.values[seen], rate) if seen.size > 2 else None
        if path is not None:
            for first, last in _crossings(path):
                lost[seen[first + 1 : last]] = True
    return lost


@dataclass(frozen=True, slots=True)
class _Path:
    """A heading as logged (n,), what of its steps is motion, which steps (n-1,) are none, and whether it is seen to wrap."""

    time: FloatArray
    values: FloatArray
    least: float
    swept: FloatArray | None
    rates: FloatArray
    calm: npt.NDArray[np.intp]
    jumps: npt.NDArray[np.intp]
    is_whole: bool

    def duration(self, first: int, last: int) -> float:
        return float(self.time[last] - self.time[first])

    def excess(self, first: int, last: int) -> float:
        """What the heading makes between two samples beyond the motion, in rad, turns counted."""
        made = float(self.values[last] - self.values[first])
        if self.swept is not None:
            return made - float(self.swept[last] - self.swept[first])
        low, high = np.searchsorted(self.calm, (first, last))
        around = self.calm[max(low - NEIGHBOURS, 0) : high + NEIGHBOURS]
        return made - (float(np.median(self.rates[around])) * self.duration(first, last) if around.size else 0.0)

    def bar(self, first: int, last: int) -> float:
        """What stands out as excess between two samples, in rad."""
        return self.least + SLACK_RAD_S * self.duration(first, last)

    def stands_out(self, step: int, sign: float) -> bool:
        """Whether a step makes more than the motion does, with a sign."""
        return sign * self.excess(step, step + 1) > self.bar(step, step + 1)


def _path(time: FloatArray, values: FloatArray, rate: Track | None) -> _Path | None:
    """Return what a crossing is judged by; None where no step is too fast, or too many are, or noise hides them."""
    steps, dt = np.diff(values), np.diff(time)
    turned = within_half_turn(steps)
    noise = noise_of_steps(np.where(np.abs(turned) > FASTEST_RAD_S * dt, np.nan, turned))
    least = max(MIN_JUMP_RAD, NOISES * math.sqrt(2.0) * noise)
    limit = np.maximum(FASTEST_RAD_S * dt, least)
    jumps = np.flatnonzero(np.abs(steps) > limit)
    spread = float(np.ptp(values)) - math.tau
    if not jumps.size or (2 * jumps.size > steps.size and spread > least):
        return None
    calm = np.flatnonzero(np.abs(turned) <= limit)
    return _Path(time, values, least, _swept(time, turned, calm, rate), turned / dt, calm, jumps, abs(spread) <= 2.0 * least)


def within_half_turn(angle: FloatArray) -> FloatArray:
    """Return angles (n,) in rad within half a turn."""
    return np.asarray(angle - math.tau * np.round(angle / math.tau))


def noise_of_steps(turned: FloatArray) -> float:
    """Return the standard deviation of white noise on a heading from its steps (n-1,), NaN where they are no motion."""
    bends = np.abs(np.diff(turned))
    bends = bends[np.isfinite(bends)]
    # A value that is held bends only now and then, by a step each time: its noise is in those, unless they are the exception.
    some = bends[bends > 1e-9]
    return 0.0 if some.size <= RARE * bends.size else robust_white_noise_std(some, 2)


def _swept(time: FloatArray, turned: FloatArray, calm: npt.NDArray[np.intp], rate: Track | None) -> FloatArray | None:
    """Return the integral (n,) of a measured rate, or None where it does not clearly agree with the heading's steps."""
    seen = np.isfinite(rate.values) if rate is not None else np.zeros(0, dtype=bool)
    if rate is None or seen.sum() < 2 or calm.size < 2:
        return None
    own, values = rate.time[seen], rate.values[seen]
    swept = np.interp(time, own, trapezoid_integral(own, values))
    said, made = np.diff(swept)[calm], turned[calm]
    power = float(said @ said)
    if not (0.0 < power < math.inf):
        return None
    slope = float(said @ made) / power
    error = float(np.std(made - slope * said)) / math.sqrt(power)
    return swept if ALIKE[0] < slope < ALIKE[1] and error < 0.1 else None


def _crossings(path: _Path) -> Iterator[tuple[int, int]]:
    """Yield the samples on both sides of each line across the wrap, in order."""
    done = 0
    for jump in path.jumps.tolist():
        if jump < done:
            continue
        found = _line(path, jump) or (_there_and_back(path, jump) if path.is_whole else None)
        if found is not None:
            yield found
            done = found[1]


def _line(path: _Path, jump: int) -> tuple[int, int] | None:
    """Return the ends of the run of steps about a jump that stand out with its sign, if together they are a turn."""
    sign = math.copysign(1.0, path.values[jump + 1] - path.values[jump])
    first, last = jump, jump + 1
    while first > 0 and path.stands_out(first - 1, sign):
        first -= 1
    while last < path.time.size - 1 and path.stands_out(last, sign):
        last += 1
    off = abs(path.excess(first, last) - sign * math.tau)
    whole = last - first > 1 and path.duration(first, last) <= math.tau / FASTEST_RAD_S
    return (first, last) if whole and off <= path.bar(first, last) else None


def _there_and_back(path: _Path, jump: int) -> tuple[int, int] | None:
    """Return the samples at the ends of the range about an excursion from there that no motion makes.

    One that the log begins or ends in has -1 or n for the sample it does not hold.
    """
    low, high = float(path.values.min()), float(path.values.max())
    start, stop = np.searchsorted(path.time, (path.time[jump] - HELD_S, path.time[jump] + HELD_S)).tolist()
    part = path.values[start:stop]
    at_wrap = (start + np.flatnonzero(np.minimum(part - low, high - part) <= 2.0 * path.least)).tolist()
    middle = bisect_right(at_wrap, jump)
    first = at_wrap[middle - 1] if middle > 0 else -1 if start == 0 else None
    last = at_wrap[middle] if middle < len(at_wrap) else path.time.size if stop == path.time.size else None
    if not at_wrap or first is None or last is None or last - first < 2:
        return None
    steps = range(max(first, 0), min(last, path.time.size - 1))
    fast = any(abs(math.remainder(path.excess(k, k + 1), math.tau)) > FASTEST_RAD_S * path.duration(k, k + 1) for k in steps)
    return (first, last) if fast else None
