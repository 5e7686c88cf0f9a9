"""Repair or refuse a log before it becomes a Run: time that repeats or goes back, and long gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.convert.times.clock_text import FEW_STEPS
from fieldsid.logs.convert.times.time_column import units_of_step
from fieldsid.logs.few_of import FEWEST
from fieldsid.logs.reader import AS_IT_IS, ReadOptions
from fieldsid.logs.run import ANGLES_AND_RATES, FINS, Note
from fieldsid.numerics.arrays import BoolArray, FloatArray

MAX_GAP_S = 2.0
"""A run in which a main signal is missing for longer than this is refused, unless the user raises the limit."""

ROUNDING = 1.01
"""Tolerance of the limit for rounding and jitter of the times, as a factor."""
FITTED = ANGLES_AND_RATES[:4]
"""Signals to which a free run is fitted."""
MAIN = (*FITTED, *FINS)
"""Signals that identification depends on."""


MAX_PLAUSIBLE_VALUE = 1e9
"""A larger value in SI is no measurement: the cell is damaged, or the column is not this signal."""
STEPS_S = (1e-7, 1e5)
"""Smallest and largest plausible median step of a log's time, for any vehicle and logger."""


def possible(signal: str, values: FloatArray) -> tuple[FloatArray, list[Note]]:
    """Return a signal (n,) with implausibly large and infinite values as NaN, and a note where there were some."""
    beyond = ~np.isnan(values) & ~(np.abs(values) <= MAX_PLAUSIBLE_VALUE)
    if not beyond.any():
        return values, []
    message = f"{signal}: numbers beyond {MAX_PLAUSIBLE_VALUE:g}, or infinite, that count as missing: {int(beyond.sum())}"
    return np.where(beyond, np.nan, values), [Note("infinite", message, {"signal": signal, "count": int(beyond.sum())})]


def likely_unit(step_s: float) -> str:
    """Return the hint to set the unit of time in which a median step is plausible; empty where there is none, or in s."""
    unit = next(iter(units_of_step(step_s)), "s")
    return "" if unit == "s" else f"set its unit, probably `unit: {unit}`"


def refuse_impossible_steps(time: FloatArray, label: str) -> None:
    """Raise LogError where the median step of a time (n,) is not plausible for a log."""
    step = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    if not STEPS_S[0] <= step <= STEPS_S[1]:
        raise LogError(
            f"{label} goes on by {step:.3g} s a sample",
            found=f"{time.size} samples from {time[0]:.6g} to {time[-1]:.6g} s",
            hint=likely_unit(step) or "check which one it is, and its unit",
        )


@dataclass(frozen=True, slots=True)
class Gap:
    """A run of `count` missing samples between two present ones at `start_s` and `end_s`."""

    start_s: float
    end_s: float
    count: int

    @property
    def length_s(self) -> float:
        """Duration of the missing samples: the time between the present samples on both sides, less one step."""
        return (self.end_s - self.start_s) * self.count / (self.count + 1)


def in_order(time: FloatArray, label: str, options: ReadOptions = AS_IT_IS) -> tuple[npt.NDArray[np.intp], list[Note]]:
    """Return the indices (m,) of the rows with which time increases strictly, and a note where others were left out.

    Rows without a time are left out. Raises LogError where time goes back or repeats, unless the options say to salvage.
    """
    rows = np.flatnonzero(np.isfinite(time))
    stamps = time[rows]
    if stamps.size == 0 or bool((np.diff(stamps) > 0).all()):
        return rows, []
    ahead = np.concatenate([[True], stamps[1:] > np.maximum.accumulate(stamps)[:-1]])
    if not options.salvage:
        raise _disorder(stamps, label, options, left=float(ahead.mean()))
    dropped = int((~ahead).sum())
    message = f"{label}: {dropped} of {stamps.size} samples were left out, time repeats or goes back there"
    return rows[ahead], [Note("time_order", message, {"dropped": dropped, "of": int(stamps.size)})]


def _disorder(stamps: FloatArray, label: str, options: ReadOptions, *, left: float) -> LogError:
    steps = np.diff(stamps)
    wrong = np.flatnonzero(steps < 0) if bool((steps < 0).any()) else np.flatnonzero(steps == 0)
    i, counted = int(wrong[0]), f"{wrong.size} of {steps.size} steps, the first"
    if steps[i] < 0:
        what, otherwise = "goes backwards", "check that this is the time, and sort the samples by it"
        found = f"{counted} from {stamps[i]:.10g} to {stamps[i + 1]:.10g} s at sample {i + 2}"
    else:
        what, otherwise = "repeats", "check that this is the time; if it is, log it with more digits"
        found = f"{counted} at {stamps[i]:.10g} s, samples {i + 1} and {i + 2}"
    hint = options.salvaging("leave such samples out", left) or otherwise
    return LogError(f"time {what} in {label}", found=found, hint=hint)


def gaps_in(time: FloatArray, values: FloatArray) -> list[Gap]:
    """Return the gaps inside a signal, without those at its two ends."""
    seen = np.flatnonzero(np.isfinite(values))
    wide = np.flatnonzero(np.diff(seen) > 1)
    return [Gap(float(time[seen[i]]), float(time[seen[i + 1]]), int(seen[i + 1] - seen[i] - 1)) for i in wide]


def long_gaps(time: FloatArray, signals: Mapping[str, FloatArray], limit_s: float) -> list[tuple[Gap, str, float]]:
    """Return the long gaps of the main signals (n,), each with its signal and the limit in s that applies to it.

    For a slow signal the limit is raised to a few of its median steps.
    """
    found = []
    for signal in (s for s in MAIN if s in signals):
        steps = np.diff(time[np.isfinite(signals[signal])])
        limit = max(limit_s, FEW_STEPS * float(np.median(steps))) if steps.size else limit_s
        found += [(gap, signal, limit) for gap in gaps_in(time, signals[signal]) if gap.length_s > ROUNDING * limit]
    return found


def refuse_long_gaps(
    time: FloatArray, signals: Mapping[str, FloatArray], options: ReadOptions = AS_IT_IS, *, limit_s: float = MAX_GAP_S
) -> None:
    """Raise LogError for the longest of the long gaps, if there is one."""
    found = long_gaps(time, signals, limit_s)
    if not found:
        return
    gap, signal, limit = max(found, key=lambda of: of[0].length_s)
    length = gap.length_s
    start, end = _longest_without(time, [g for g, _, _ in found])
    hint = f"accept it: {options.with_option(f'--max-gap {length + 0.1:.1f}')}"
    if np.count_nonzero((time >= start) & (time <= end)) > FEWEST:
        hint += f"; or take the longest part without one: {options.with_option(f'--from {start:.2f} --to {end:.2f}')}"
    raise LogError(
        f"`{signal}` is missing for {length:.2f} s (limit {limit:.3g} s)",
        found=f"{gap.count} samples without a number between {gap.start_s:.2f} and {gap.end_s:.2f} s",
        hint=hint,
    )


def _longest_without(time: FloatArray, gaps: Sequence[Gap]) -> tuple[float, float]:
    """Return start and end in s of the longest part of a log that no gap touches."""
    begin = float(time[0])
    parts = []
    for gap in sorted(gaps, key=lambda g: g.start_s):
        parts.append((begin, gap.start_s))
        begin = max(begin, gap.end_s)
    return max([*parts, (begin, float(time[-1]))], key=lambda part: part[1] - part[0])


def blocks_of(mask: BoolArray) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the first index of each block of a mask (n,), and the index after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges[::2], edges[1::2]
