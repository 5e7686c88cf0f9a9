"""Repair and refusal before a log becomes a Run: time that repeats or goes back, and long runs of missing samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.run import FloatArray, Note

MAX_GAP_S = 2.0
"""A main signal missing for longer than this inside a run is refused unless the user raises the limit."""

ROUNDING = 1.01
"""What a gap of just the limit may be over it, by the rounding and the jitter of the times."""

MAIN = (
    "yaw_rad", "yaw_rate_rad_s", "pitch_rad", "pitch_rate_rad_s",
    "rudder_rad", "elevator_rad", "rudder_measured_rad", "elevator_measured_rad",
)  # fmt: skip
"""Signals that identification stands on."""


@dataclass(frozen=True, slots=True)
class Gap:
    """Missing samples between two that are there: from `start_s` to `end_s`, `count` of them."""

    start_s: float
    end_s: float
    count: int

    @property
    def length_s(self) -> float:
        """Time the missing samples would have stood for: between those on both sides, less a step."""
        return (self.end_s - self.start_s) * self.count / (self.count + 1)


def in_order(time: FloatArray, label: str, *, salvage: bool = False, log: str = "LOG") -> tuple[npt.NDArray[np.intp], list[Note]]:
    """Return the rows (m,) with which time increases strictly, and a note where others were left out.

    Rows without a time are left out. Without `salvage`, raises LogError where time goes back or repeats.
    """
    rows = np.flatnonzero(np.isfinite(time))
    stamps = time[rows]
    if stamps.size == 0 or bool((np.diff(stamps) > 0).all()):
        return rows, []
    if not salvage:
        raise _disorder(stamps, label, log)
    ahead = np.concatenate([[True], stamps[1:] > np.maximum.accumulate(stamps)[:-1]])
    dropped = int((~ahead).sum())
    message = f"{label}: {dropped} of {stamps.size} samples were left out, time repeats or goes back there"
    return rows[ahead], [Note("time_order", message, {"dropped": dropped, "of": int(stamps.size)})]


def _disorder(stamps: FloatArray, label: str, log: str) -> LogError:
    steps = np.diff(stamps)
    back, repeated = np.flatnonzero(steps < 0), np.flatnonzero(steps == 0)
    hint = f"leave such samples out: `sysid import {log} --salvage -o runs/`"
    if back.size:
        i = int(back[0])
        return LogError(
            f"time goes backwards in {label}",
            found=f"{back.size} of {steps.size} steps, the first from {stamps[i]:.6f} to {stamps[i + 1]:.6f} s at sample {i + 2}",
            hint=hint,
        )
    i = int(repeated[0])
    return LogError(
        f"time repeats in {label}",
        found=f"{repeated.size} of {steps.size} steps, the first at {stamps[i]:.6f} s, samples {i + 1} and {i + 2}",
        hint=hint,
    )


def gaps_in(time: FloatArray, values: FloatArray) -> list[Gap]:
    """Return the runs of missing samples inside a signal, those at its two ends left out."""
    seen = np.flatnonzero(np.isfinite(values))
    wide = np.flatnonzero(np.diff(seen) > 1)
    return [Gap(float(time[seen[i]]), float(time[seen[i + 1]]), int(seen[i + 1] - seen[i] - 1)) for i in wide]


def refuse_long_gaps(
    time: FloatArray, signals: Mapping[str, FloatArray], *, limit_s: float = MAX_GAP_S, log: str = "LOG"
) -> None:
    """Raise LogError naming the longest gap of a main signal above the limit."""
    worst = max(
        ((g.length_s, s, g) for s in MAIN if s in signals for g in gaps_in(time, signals[s])), default=None, key=lambda w: w[0]
    )
    if worst is None or worst[0] <= ROUNDING * limit_s:
        return
    length, signal, gap = worst
    raise LogError(
        f"`{signal}` is missing for {length:.2f} s (limit {limit_s:g} s)",
        found=f"{gap.count} samples without a number between {gap.start_s:.2f} and {gap.end_s:.2f} s",
        hint=f"accept it with `sysid import {log} --max-gap {length + 0.1:.1f} -o runs/`, or `--to {gap.start_s:.2f}`",
    )
