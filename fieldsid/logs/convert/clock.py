"""Signals of several rates on one clock, without inventing data.

The clock is that of the angle or rate with the most samples a second; all others come to it. A command stands
until the next one (zero-order hold). A measurement is straight between two samples that are neighbours, that is no
further apart than `gap_factor` of their median period; elsewhere it is NaN, and nothing is extrapolated. What a model is fitted
to, an angle or a rate, keeps its noise as it was: each stamp has the own sample next to it, moved there along the slope through
its neighbours, and a signal slower than the clock counts once for each of its own samples. On the line between two of them noise
would be smaller than it is, and coloured.

A fin that moves between two samples of that clock keeps the times of its own. Held from the next sample on instead, it would
be late by as much: at 5 Hz up to 0.2 s, 28 % of a damping of 1/s. What a hull does with the fin d(t) over a step of length h
from t0 on is, with m the middle of the step and s = t - m,

    rate(h) = e^(-a h) rate0 + b int e^(-a (h/2 - s)) d ds,    angle(h) = ... + b int (1 - e^(-a (h/2 - s))) / a d ds.

Both kernels are smooth in s, so that the integrals follow from the moments of d: int d ds = h mean, and int s d ds; the next one
weighs a^2 h^3 / 24 of the change. The straight line with the same two moments, mean -/+ 6 int s d ds / h^2 at its ends, moves the
hull as d does: for a command that jumps by j at the share c of the step, mean = d0 + j (1 - c), int s d ds = j h^2 c (1 - c) / 2.
With the fin's angle at both samples the jump itself comes back from them (`effects/_paths.py`), for the gear behind it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.errors import MappingError
from fieldsid.logs.run import COMMANDS, PART, STEP_LINES, Note, signal_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

ANGLES_AND_RATES = ("yaw_rad", "yaw_rate_rad_s", "pitch_rad", "pitch_rate_rad_s", "roll_rad", "roll_rate_rad_s")
"""Signals whose clock the others come to, the first one where rates are equal."""

SLOWER = 1.5
"""Steps of the clock from which on a signal's own step is slower."""
GAP_FACTOR = 2.5
"""Steps of the usual length above which one is a gap, unless a mapping says another number."""


@dataclass(frozen=True, slots=True)
class Track:
    """One signal on its own clock: time (n,) in s, strictly increasing, and values (n,)."""

    time: FloatArray
    values: FloatArray
    label: str = ""

    @property
    def period(self) -> float:
        """Median step in s; infinite for fewer than two samples."""
        return float(np.median(np.diff(self.time))) if self.time.size > 1 else float("inf")


def base_of(tracks: Mapping[str, Track], asked: str | None = None) -> str:
    """Return the signal whose clock is the run's; raises MappingError when the one asked for is not mapped."""
    if asked is not None:
        if asked in tracks:
            return asked
        raise MappingError(f"`clock: {asked}` is no mapped signal", found=", ".join(tracks), hint=near(asked, list(tracks)))
    candidates = [s for s in ANGLES_AND_RATES if s in tracks] or list(tracks)
    return min(candidates, key=lambda s: tracks[s].period)


def one_clock(
    tracks: Mapping[str, Track], *, clock: str | None = None, gap_factor: float = GAP_FACTOR
) -> tuple[FloatArray, dict[str, FloatArray], list[Note]]:
    """Return the time (n,), the signals (n,) on it, and a note that says how they came there."""
    base = base_of(tracks, clock)
    time = tracks[base].time
    signals = {s: held(t, time) if s in COMMANDS else straight(t, time, gap_factor) for s, t in tracks.items()}
    for signal in (s for s in ANGLES_AND_RATES if s in tracks and not np.array_equal(tracks[s].time, time)):
        once = tracks[signal].period > SLOWER * tracks[base].period
        signals[signal] = np.where(np.isfinite(signals[signal]), moved(tracks[signal], time, once=once), np.nan)
    for fin, names in STEP_LINES.items():
        line = line_over_steps(tracks[fin], time, gap_factor, is_held=fin in COMMANDS) if fin in tracks else None
        signals |= {} if line is None else dict(zip(names, line, strict=True))
    others = sorted({t.label.partition(".")[0] for t in tracks.values() if not np.array_equal(t.time, time)})
    rate = 1.0 / tracks[base].period
    message = f"the clock is that of `{base}` ({tracks[base].label.partition('.')[0]}, {rate:.4g} Hz)"
    if others:
        message += f"; brought to it: {', '.join(others)}"
    return time, signals, [Note("clock", message, {"signal": base, "rate_hz": rate})]


def summed(tracks: Mapping[str, Track], gap_factor: float) -> dict[str, Track]:
    """Return the tracks with the entries of each sum as one, which changes whenever one of them does.

    Between its own stamps an entry is what it is on any other clock: a command stands, a measurement is straight. Where none of
    them has a number the sum has none.
    """
    whole = {s: t for s, t in tracks.items() if PART not in s}
    for signal in dict.fromkeys(signal_of(s) for s in tracks if PART in s):
        entries = [t for s, t in tracks.items() if PART in s and signal_of(s) == signal]
        time = np.unique(np.concatenate([t.time for t in entries]))
        seen = np.concatenate([t.time[np.isfinite(t.values)] for t in entries])
        on_it = [held(t, time) if signal in COMMANDS else straight(t, time, gap_factor) for t in entries]
        values = np.where(np.isin(time, seen), np.sum(on_it, axis=0), np.nan)
        whole[signal] = Track(time, values, " + ".join(t.label for t in entries))
    return whole


def line_over_steps(track: Track, time: FloatArray, gap_factor: float, *, is_held: bool) -> FloatArray | None:
    """Return start and end (2, n) of a line for each step that a sample of `time` (n,) begins; None where no stamp lies inside.

    It has mean and first moment of the track over the step, NaN where that is unknown; the last sample begins none.
    """
    own = track.time[np.isfinite(track.values)]
    inside = own[(own > time[0]) & (own < time[-1])]
    if np.isin(inside, time).all():
        return None
    knots = np.union1d(time, inside)
    if is_held:
        start = end = held(track, knots[:-1])
    else:
        values = straight(track, knots, gap_factor)
        start, end = values[:-1], values[1:]
    step, length = np.searchsorted(time, knots[:-1], side="right") - 1, np.diff(knots)
    whole = np.diff(time)
    off = knots[:-1] + 0.5 * length - (time[:-1] + 0.5 * whole)[step]
    mean = np.bincount(step, 0.5 * (start + end) * length) / whole
    moment = np.bincount(step, (0.5 * (start + end) * off + (end - start) * length / 12.0) * length)
    half = 6.0 * moment / whole**2
    return np.pad(np.stack([mean - half, mean + half]), ((0, 0), (0, 1)), constant_values=np.nan)


def held(track: Track, time: FloatArray) -> FloatArray:
    """Return the last value (n,) at or before each time, NaN before the first."""
    seen = np.isfinite(track.values)
    index = np.searchsorted(track.time[seen], time, side="right") - 1
    values = track.values[seen]
    return np.where(index < 0, np.nan, values[np.maximum(index, 0)]) if values.size else np.full(time.size, np.nan)


def moved(track: Track, time: FloatArray, *, once: bool) -> FloatArray:
    """Return the own sample next to each time (n,), moved there along its slope; `once`: NaN but where it is next to that one."""
    seen = np.isfinite(track.values)
    own, values = track.time[seen], track.values[seen]
    if own.size < 2:
        return np.full(time.size, np.nan)
    near = _nearest(own, time)
    out = values[near] + np.gradient(values, own)[near] * (time - own[near])
    return np.where(np.isin(np.arange(time.size), _nearest(time, own)), out, np.nan) if once else np.asarray(out)


def _nearest(of: FloatArray, to: FloatArray) -> npt.NDArray[np.intp]:
    """Return which of some rising times (n,) is nearest to each of others (m,)."""
    above = np.searchsorted(of, to).clip(1, of.size - 1)
    return np.where(to - of[above - 1] <= of[above] - to, above - 1, above)


def straight(track: Track, time: FloatArray, gap_factor: float) -> FloatArray:
    """Return values (n,) on straight lines between neighbours, NaN in gaps and outside; samples that coincide unchanged."""
    seen = np.isfinite(track.values)
    own, values = track.time[seen], track.values[seen]
    result = np.full(time.size, np.nan)
    if not own.size:
        return result
    above = np.searchsorted(own, time, side="left")
    meets = (above < own.size) & (own[np.minimum(above, own.size - 1)] == time)
    result[meets] = values[above[meets]]
    limit = gap_factor * float(np.median(np.diff(own))) if own.size > 1 else 0.0
    inside = ~meets & (above > 0) & (above < own.size)
    low, high = above[inside] - 1, above[inside]
    width = own[high] - own[low]
    share = (time[inside] - own[low]) / width
    between = values[low] + share * (values[high] - values[low])
    result[inside] = np.where(width <= limit * (1.0 + 1e-9), between, np.nan)
    return result
