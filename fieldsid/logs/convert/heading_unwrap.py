"""Repair a heading that was interpolated across its wrap, before it is unwrapped.

A logger that resamples a wrapped heading interpolates from one end of the range to the other, the long way round:
3.13, 0.00, -3.13. Such a sample is the true heading minus 2 pi s, with s the fraction of the interval, which the log
does not contain; the true heading cannot be recovered, so the samples are replaced. They are detected by their
neighbours: the step across them differs from the motion by one turn, and each step among them is faster than a
vehicle turns. The motion is the integral of the measured rate if that agrees with the heading, else it is estimated
from the steps around. Where the range ends does not matter.

A vehicle that keeps its heading at the wrap gives excursions there and back (3.14, 0.01, 0.00, 3.14). The step across
such samples does not contain a turn; they are distinguished from a spike by the samples before and after them, which
lie at the ends of the range.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.clock import GAP_FACTOR, Track, interpolated
from fieldsid.logs.convert.frames import unwrapped
from fieldsid.logs.few_of import few_of
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.trapezoid import trapezoid_integral
from fieldsid.numerics.white_noise import robust_white_noise_std

FASTEST_RAD_S = 3.0
"""A faster step is no motion of a vehicle."""
LONGEST_SWEEP_S = math.tau / FASTEST_RAD_S
"""A sweep of one turn that takes longer is a real turn; a heading that is kept at the wrap comes back to it in half this time."""
SLACK_RAD_S = 0.5
"""Largest difference of the rate at a crossing of the wrap from that of the steps around it."""
MIN_JUMP_RAD = 0.03
NOISES = 6.0
"""A step is significant above this many standard deviations of the noise, and above `MIN_JUMP_RAD`."""
NEIGHBOURS = 8
"""Number of steps on each side from which the motion is estimated."""
ALIKE = (math.sqrt(0.5), math.sqrt(2.0))
"""Ratios of two sensors' readings of one motion between which they agree; a wrong unit gives a ratio further off."""
RARE = 0.02
"""Share of samples with a nonzero second difference, up to which these do not show the level of the noise."""


def unwrapped_over(heading: Track, rate: Track | None = None, gap_factor: float = GAP_FACTOR) -> tuple[Track, list[Note]]:
    """Return a heading (n,) in rad without jumps of a turn, and a note where samples were interpolated across its wrap.

    Those samples are replaced by linear interpolation between their neighbours, or are NaN where these are further apart
    than `gap_factor` median periods. All others keep their value up to whole turns.
    """
    replaced = _interpolated(heading, rate)
    values = unwrapped(np.where(replaced, np.nan, heading.values))
    if not replaced.any():
        return Track(heading.time, values, heading.label), []
    values[replaced] = interpolated(Track(heading.time, values), heading.time[replaced], gap_factor)
    return Track(heading.time, values, heading.label), [_note(heading.time[replaced], int(np.isnan(values[replaced]).sum()))]


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
    """Return a mask (n,) of the samples that were interpolated across the wrap."""
    replaced = np.zeros(heading.values.size, dtype=bool)
    seen = np.flatnonzero(np.isfinite(heading.values))
    # Values of a damaged log may be near the largest float; a step that overflows is no turn.
    with np.errstate(over="ignore", invalid="ignore"):
        path = _path(heading.time[seen], heading.values[seen], rate) if seen.size > 2 else None
        if path is not None:
            for first, last in _crossings(path):
                replaced[seen[first + 1 : last]] = True
    return replaced


@dataclass(frozen=True, slots=True)
class _Path:
    """A heading as logged (n,) with its steps (n-1,) divided into motion and jumps.

    least: the smallest significant step in rad. swept: the integral (n,) of the measured rate, None without a usable one.
    rates: the steps within half a turn per second. calm, jumps: indices of the steps that are motion and of those that are
    not. covers_turn: whether the values cover a range of one turn, so that the heading is known to wrap.
    """

    time: FloatArray
    values: FloatArray
    least: float
    swept: FloatArray | None
    rates: FloatArray
    calm: npt.NDArray[np.intp]
    jumps: npt.NDArray[np.intp]
    covers_turn: bool

    def duration(self, first: int, last: int) -> float:
        return float(self.time[last] - self.time[first])

    def excess(self, first: int, last: int) -> float:
        """Return the change of the heading between two samples minus the motion, in rad, whole turns included."""
        made = float(self.values[last] - self.values[first])
        if self.swept is not None:
            return made - float(self.swept[last] - self.swept[first])
        low, high = np.searchsorted(self.calm, (first, last))
        around = self.calm[max(low - NEIGHBOURS, 0) : high + NEIGHBOURS]
        return made - (float(np.median(self.rates[around])) * self.duration(first, last) if around.size else 0.0)

    def limit_of_excess(self, first: int, last: int) -> float:
        """Return the excess in rad above which the change between two samples is significant."""
        return self.least + SLACK_RAD_S * self.duration(first, last)

    def is_significant(self, step: int, sign: float) -> bool:
        """Whether a step exceeds the motion significantly, in the direction of `sign`."""
        return sign * self.excess(step, step + 1) > self.limit_of_excess(step, step + 1)


def _path(time: FloatArray, values: FloatArray, rate: Track | None) -> _Path | None:
    """Return a heading with its steps divided into motion and jumps; None without a jump, or if most steps are jumps (noise)."""
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
    """Return angles (n,) in rad reduced to the range from -pi to pi."""
    return np.asarray(angle - math.tau * np.round(angle / math.tau))


def noise_of_steps(turned: FloatArray) -> float:
    """Return the standard deviation of the white noise on a heading, from its steps (n-1,), of which jumps are NaN."""
    bends = np.abs(np.diff(turned))
    bends = bends[np.isfinite(bends)]
    # A value repeated over several samples has second differences only where it changes: those show its noise, unless rare.
    some = bends[bends > 1e-9]
    return 0.0 if some.size <= RARE * bends.size else robust_white_noise_std(some, 2)


def _swept(time: FloatArray, turned: FloatArray, calm: npt.NDArray[np.intp], rate: Track | None) -> FloatArray | None:
    """Return the integral (n,) in rad of a measured rate, or None where it does not clearly agree with the heading's steps."""
    seen = np.isfinite(rate.values) if rate is not None else np.zeros(0, dtype=bool)
    if rate is None or seen.sum() < 2 or calm.size < 2:
        return None
    stamps, values = rate.time[seen], rate.values[seen]
    swept = np.interp(time, stamps, trapezoid_integral(stamps, values))
    integrated, logged = np.diff(swept)[calm], turned[calm]
    power = float(integrated @ integrated)
    if not (0.0 < power < math.inf):
        return None
    slope = float(integrated @ logged) / power
    error = float(np.std(logged - slope * integrated)) / math.sqrt(power)
    return swept if ALIKE[0] < slope < ALIKE[1] and error < 0.1 else None


def _crossings(path: _Path) -> Iterator[tuple[int, int]]:
    """Yield, in order, the last sample before and the first one after each interpolation across the wrap."""
    done = 0
    for jump in path.jumps.tolist():
        if jump < done:
            continue
        found = _line(path, jump) or (_there_and_back(path, jump) if path.covers_turn else None)
        if found is not None:
            yield found
            done = found[1]


def _line(path: _Path, jump: int) -> tuple[int, int] | None:
    """Return the ends of the significant steps of one sign around a jump, if their sum is one turn; else None."""
    sign = math.copysign(1.0, path.values[jump + 1] - path.values[jump])
    first, last = jump, jump + 1
    while first > 0 and path.is_significant(first - 1, sign):
        first -= 1
    while last < path.time.size - 1 and path.is_significant(last, sign):
        last += 1
    off = abs(path.excess(first, last) - sign * math.tau)
    is_possible = last - first > 1 and path.duration(first, last) <= LONGEST_SWEEP_S
    return (first, last) if is_possible and off <= path.limit_of_excess(first, last) else None


def _there_and_back(path: _Path, jump: int) -> tuple[int, int] | None:
    """Return the samples at the ends of the range before and after an excursion that is too fast to be motion; else None.

    Where the log begins or ends inside the excursion, the missing sample is -1 or n.
    """
    low, high = float(path.values.min()), float(path.values.max())
    start, stop = np.searchsorted(path.time, path.time[jump] + 0.5 * LONGEST_SWEEP_S * np.array([-1.0, 1.0])).tolist()
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
