"""Signals of several rates on one clock, without inventing data.

The clock is that of the angle or rate with the most samples a second; all others come to it. A command stands
until the next one (zero-order hold). A measurement is straight between two samples that are neighbours, that is no
further apart than `gap_factor` of their median period; elsewhere it is NaN, and nothing is extrapolated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.errors import MappingError
from fieldsid.logs.run import GOALS, PART, Note, signal_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

COMMANDS = frozenset({"rudder_rad", "elevator_rad", "thrust", "thrust_ratio", "propeller_rpm"}) | GOALS
"""Signals that stand until the next one."""

ANGLES_AND_RATES = ("yaw_rad", "yaw_rate_rad_s", "pitch_rad", "pitch_rate_rad_s", "roll_rad", "roll_rate_rad_s")
"""Signals whose clock the others come to, the first one where rates are equal."""


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
    tracks: Mapping[str, Track], *, clock: str | None = None, gap_factor: float = 2.5
) -> tuple[FloatArray, dict[str, FloatArray], list[Note]]:
    """Return the time (n,), the signals (n,) on it, and a note that says how they came there."""
    base = base_of(tracks, clock)
    time = tracks[base].time
    signals = {s: held(t, time) if s in COMMANDS else straight(t, time, gap_factor) for s, t in tracks.items()}
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


def held(track: Track, time: FloatArray) -> FloatArray:
    """Return the last value (n,) at or before each time, NaN before the first."""
    seen = np.isfinite(track.values)
    index = np.searchsorted(track.time[seen], time, side="right") - 1
    values = track.values[seen]
    return np.where(index < 0, np.nan, values[np.maximum(index, 0)]) if values.size else np.full(time.size, np.nan)


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
