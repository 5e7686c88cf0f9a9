"""Bring signals of several sampling rates to one clock, without inventing data.

The clock is that of the angle or rate with the most samples a second; all other signals are resampled to it. A command is
held constant until the next one (zero-order hold). A measurement is interpolated linearly between two neighbouring samples if
they are no further apart than `gap_factor` median periods; elsewhere it is NaN, and nothing is extrapolated. An angle or a rate,
to which a model is fitted, is not interpolated, because noise interpolated between two samples is smaller than the sensor's, and
coloured. Instead each stamp of the clock gets the nearest sample of the signal, shifted to that stamp along the slope through
its neighbours; each sample of a signal slower than the clock is used once.

A fin that moves between two samples of that clock keeps the times at which it moved. If its value were held constant from the
next sample on instead, it would be late by up to a step: at 5 Hz up to 0.2 s, 28 % of a damping of 1/s. The response of the
hull to the fin d(t) over a step of length h from t0 on is, with m the middle of the step and s = t - m,

    rate(h) = e^(-a h) rate0 + b int e^(-a (h/2 - s)) d ds,    angle(h) = ... + b int (1 - e^(-a (h/2 - s))) / a d ds.

Both kernels are smooth in s, so that the integrals follow from the moments of d: int d ds = h mean, and int s d ds; the second
moment contributes a^2 h^3 / 24 of the change. The straight line with the same two moments, mean -/+ 6 int s d ds / h^2 at its
ends, has the same effect on the hull as d: for a command that jumps by j at the fraction c of the step, mean = d0 + j (1 - c) and
int s d ds = j h^2 c (1 - c) / 2. From the line and the fin's angle at both samples `effects/_paths.py` reconstructs the jump, as
the model of a steering gear needs it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.errors import MappingError
from fieldsid.logs.run import ANGLES_AND_RATES, COMMANDS, PART, STEP_LINES, Note, signal_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

SLOWER = 1.5
"""Ratio of a signal's median step to that of the clock above which the signal counts as slower than the clock."""
GAP_FACTOR = 2.5
"""Multiple of the median step above which a step is a gap, unless a mapping states another number."""


@dataclass(frozen=True, slots=True)
class Track:
    """One signal at its original stamps: time (n,) in s, strictly increasing, and values (n,)."""

    time: FloatArray
    values: FloatArray
    label: str = ""

    @property
    def period(self) -> float:
        """Median step in s; infinite for fewer than two samples."""
        return float(np.median(np.diff(self.time))) if self.time.size > 1 else float("inf")


def base_of(tracks: Mapping[str, Track], requested: str | None = None) -> str:
    """Return the signal whose clock becomes that of the run; raises MappingError when the requested one is not mapped."""
    if requested is not None:
        if requested in tracks:
            return requested
        raise MappingError(
            f"`clock: {requested}` is no mapped signal", found=", ".join(tracks), hint=near(requested, list(tracks))
        )
    candidates = [s for s in ANGLES_AND_RATES if s in tracks] or list(tracks)
    return min(candidates, key=lambda s: tracks[s].period)


def one_clock(
    tracks: Mapping[str, Track], *, clock: str | None = None, gap_factor: float = GAP_FACTOR
) -> tuple[FloatArray, dict[str, FloatArray], list[Note]]:
    """Return the time (n,), the signals (n,) resampled to it, and a note that says which clock was chosen."""
    base = base_of(tracks, clock)
    time = tracks[base].time
    signals = {s: zero_order_hold(t, time) if s in COMMANDS else interpolated(t, time, gap_factor) for s, t in tracks.items()}
    for signal in (s for s in ANGLES_AND_RATES if s in tracks and not np.array_equal(tracks[s].time, time)):
        once = tracks[signal].period > SLOWER * tracks[base].period
        signals[signal] = np.where(np.isfinite(signals[signal]), shifted(tracks[signal], time, once=once), np.nan)
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
    """Return the tracks, with the terms of each signal that is a sum added up to one track on the union of their stamps.

    Between its stamps a command is held constant, and a measurement is interpolated linearly. The sum is NaN at stamps at which
    no term has a number.
    """
    added_up = {s: t for s, t in tracks.items() if PART not in s}
    for signal in dict.fromkeys(signal_of(s) for s in tracks if PART in s):
        entries = [t for s, t in tracks.items() if PART in s and signal_of(s) == signal]
        time = np.unique(np.concatenate([t.time for t in entries]))
        seen = np.concatenate([t.time[np.isfinite(t.values)] for t in entries])
        terms = [zero_order_hold(t, time) if signal in COMMANDS else interpolated(t, time, gap_factor) for t in entries]
        values = np.where(np.isin(time, seen), np.sum(terms, axis=0), np.nan)
        added_up[signal] = Track(time, values, " + ".join(t.label for t in entries))
    return added_up


def line_over_steps(track: Track, time: FloatArray, gap_factor: float, *, is_held: bool) -> FloatArray | None:
    """Return the values (2, n) at both ends of a line for the step that begins at each sample of `time` (n,).

    The line has the mean and the first moment of the track over the step; it is NaN where they are unknown, and at the last
    sample, where no step begins. Returns None where no stamp of the track lies between two samples of `time`.
    """
    stamps = track.time[np.isfinite(track.values)]
    inside = stamps[(stamps > time[0]) & (stamps < time[-1])]
    if np.isin(inside, time).all():
        return None
    knots = np.union1d(time, inside)
    if is_held:
        start = end = zero_order_hold(track, knots[:-1])
    else:
        values = interpolated(track, knots, gap_factor)
        start, end = values[:-1], values[1:]
    step, length = np.searchsorted(time, knots[:-1], side="right") - 1, np.diff(knots)
    full_length = np.diff(time)
    off = knots[:-1] + 0.5 * length - (time[:-1] + 0.5 * full_length)[step]
    mean = np.bincount(step, 0.5 * (start + end) * length) / full_length
    moment = np.bincount(step, (0.5 * (start + end) * off + (end - start) * length / 12.0) * length)
    half = 6.0 * moment / full_length**2
    return np.pad(np.stack([mean - half, mean + half]), ((0, 0), (0, 1)), constant_values=np.nan)


def zero_order_hold(track: Track, time: FloatArray) -> FloatArray:
    """Return a track held constant between its samples: the last value (n,) at or before each time, NaN before the first."""
    seen = np.isfinite(track.values)
    index = np.searchsorted(track.time[seen], time, side="right") - 1
    values = track.values[seen]
    return np.where(index < 0, np.nan, values[np.maximum(index, 0)]) if values.size else np.full(time.size, np.nan)


def shifted(track: Track, time: FloatArray, *, once: bool) -> FloatArray:
    """Return the sample of a track nearest to each time (n,), shifted to that time along the local slope.

    With `once` each sample is used only at the time nearest to it, and all other times are NaN.
    """
    seen = np.isfinite(track.values)
    stamps, values = track.time[seen], track.values[seen]
    if stamps.size < 2:
        return np.full(time.size, np.nan)
    near = _nearest(stamps, time)
    out = values[near] + np.gradient(values, stamps)[near] * (time - stamps[near])
    return np.where(np.isin(np.arange(time.size), _nearest(time, stamps)), out, np.nan) if once else np.asarray(out)


def _nearest(stamps: FloatArray, times: FloatArray) -> npt.NDArray[np.intp]:
    """Return the index (m,) of the increasing stamp (n,) nearest to each of some times (m,)."""
    above = np.searchsorted(stamps, times).clip(1, stamps.size - 1)
    return np.where(times - stamps[above - 1] <= stamps[above] - times, above - 1, above)


def interpolated(track: Track, time: FloatArray, gap_factor: float) -> FloatArray:
    """Return a track (n,) interpolated linearly at some times, NaN in gaps and outside; samples at these very times are kept."""
    seen = np.isfinite(track.values)
    stamps, values = track.time[seen], track.values[seen]
    if not stamps.size:
        return np.full(time.size, np.nan)
    limit = gap_factor * float(np.median(np.diff(stamps))) * (1.0 + 1e-9) if stamps.size > 1 else 0.0
    above = np.searchsorted(stamps, time).clip(max=stamps.size - 1)
    is_near = (stamps[above] == time) | (stamps[above] - stamps[np.maximum(above - 1, 0)] <= limit)
    return np.where(is_near, np.interp(time, stamps, values, left=np.nan, right=np.nan), np.nan)
