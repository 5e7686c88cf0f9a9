"""Which of several headings is the vehicle's own: a course over ground under a heading's name turns with the way, not before it.

A hull slides out of its turn: its heading is ahead of its course by the sideslip, which goes with the rate of turn (Fossen 2021,
section 6.5). The time by which an angle leads the course of x and y, psi - chi = T r + current, is nil or negative for a course,
whose receiver is late, and clearly positive for a compass. Where a rate of turn is logged, the heading is the one it makes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.logs.run import Note, Run
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.trapezoid import trapezoid_integral

WINDOW_S = 1.0
"""Time over which a course and a rate are taken."""
LEAST_WAY_M = 0.1
FEWEST = 50
SURE = 4.0
"""Standard errors by which one heading must lead, and the other not."""
BETTER = 2.0
"""How many times as well as another a heading must follow the rate of turn that is logged."""


@dataclass(frozen=True, slots=True)
class Lead:
    """By how many s an angle is ahead of the course that is made, and the standard error."""

    seconds: float
    error: float

    @property
    def is_clear(self) -> bool:
        """Whether the angle is surely ahead: that of a hull that slides out of its turns."""
        return self.seconds > SURE * self.error


def better_heading(runs: Sequence[Run], names: Sequence[str]) -> tuple[int, Note] | None:
    """Return which of the headings of one log, the first taken so far, is the vehicle's own in place of it, and why; or None."""
    misfits = [_off_rate(run) for run in runs]
    best = min(range(len(runs)), key=lambda i: misfits[i])
    if np.isfinite(misfits[0]) and best != 0 and misfits[0] > BETTER * misfits[best]:
        why = (
            f"over {WINDOW_S:g} s the logged rate makes it within {misfits[best]:.2g} rad, the other within {misfits[0]:.2g} rad"
        )
        return best, _taken(names, best, why)
    other = lead_of(runs[0])
    if np.isfinite(misfits[0]) or other is None or other.is_clear:
        return None
    leads = {i: lead for i, run in enumerate(runs) if (lead := lead_of(run)) is not None and lead.is_clear}
    if not leads:
        return None
    best, own = max(leads.items(), key=lambda found: found[1].seconds)
    why = (
        f"in turns it is {own.seconds:.2f} +/- {own.error:.2f} s ahead of the course of x_m and y_m, as a hull that slides is; "
        f"the other is that course ({other.seconds:.2f} +/- {other.error:.2f} s)"
    )
    return best, _taken(names, best, why)


def _taken(names: Sequence[str], best: int, why: str) -> Note:
    message = f"yaw_rad is taken from {names[best]} and not from {names[0]}, which is a course over ground: {why}"
    return Note("evidence", message, {"signal": "yaw_rad", "others": [names[0]]})


def _off_rate(run: Run) -> float:
    """Return by how many rad a heading's change over a window is off the integral of the yaw rate; infinite without one."""
    if not (run.has("yaw_rad") and run.has("yaw_rate_rad_s")):
        return float("inf")
    good = np.isfinite(run["yaw_rad"]) & np.isfinite(run["yaw_rate_rad_s"])
    time, yaw, rate = run.time[good], run["yaw_rad"][good], run["yaw_rate_rad_s"][good]
    width = _width(time)
    if time.size < FEWEST + width:
        return float("inf")
    swept = trapezoid_integral(time, rate)
    off = (yaw[width:] - yaw[:-width]) - (swept[width:] - swept[:-width])
    return float(np.std(off))


def lead_of(run: Run) -> Lead | None:
    """Return by how much the heading of a run leads its course; None where the log does not show it."""
    if not all(run.has(s) for s in ("yaw_rad", "x_m", "y_m")):
        return None
    good = np.all([np.isfinite(run[s]) for s in ("yaw_rad", "x_m", "y_m")], axis=0)
    time, yaw, x, y = run.time[good], run["yaw_rad"][good], run["x_m"][good], run["y_m"][good]
    width = 2 * max(1, _width(time) // 2)
    if time.size < FEWEST + width:
        return None
    dx, dy = x[width:] - x[:-width], y[width:] - y[:-width]
    middle, rate = yaw[width // 2 : -width // 2], (yaw[width:] - yaw[:-width]) / (time[width:] - time[:-width])
    moved = np.hypot(dx, dy) > LEAST_WAY_M
    if moved.sum() < FEWEST:
        return None
    return _regressed((middle - np.arctan2(dy, dx))[moved], middle[moved], rate[moved], width)


def _regressed(off: FloatArray, yaw: FloatArray, rate: FloatArray, width: int) -> Lead | None:
    """Return the slope of an angle's difference from the course (n,) on its rate, beside an offset and a current's two parts."""
    turned = np.exp(1j * off)
    angle = np.angle(turned * np.conj(np.mean(turned)))
    base = np.stack([rate, np.ones_like(rate), np.cos(yaw), np.sin(yaw)], axis=1)
    values, _, rank, _ = np.linalg.lstsq(base, angle, rcond=None)
    if rank < base.shape[1]:
        return None
    left = angle - base @ values
    # windows that overlap say the same `width` times
    spread = width * float(left @ left) / max(angle.size - width * base.shape[1], 1)
    covariance = np.linalg.inv(base.T @ base) * spread
    return Lead(float(values[0]), float(np.sqrt(covariance[0, 0])))


def _width(time: FloatArray) -> int:
    return max(1, round(WINDOW_S / float(np.median(np.diff(time))))) if time.size > 1 else 1
