"""Which of several headings is the vehicle's own: a course over ground under a heading's name turns with the way, not before it.

A hull slides out of its turn: its heading is ahead of its course by the sideslip, which goes with the rate of turn (Fossen 2021,
section 6.5). The time by which an angle leads the course of x and y, psi - chi = T r + current, is nil or negative for a course,
whose receiver is late, and clearly positive for a compass. Where a rate of turn is logged, the heading is the one it makes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.logs.doctor.angle_and_rate import PAIRS, changes_of
from fieldsid.logs.doctor.course_findings import course_of
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.arrays import FloatArray

WINDOW_S = 1.0
"""Time over which a course is taken: in a longer one a vehicle turns more than once."""
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
        why = f"the logged rate makes it within {misfits[best]:.2g} rad, the other within {misfits[0]:.2g} rad"
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
    changes = changes_of(run, *PAIRS[0])
    return float("inf") if changes is None else float(np.std(changes[0] - changes[1]))


def lead_of(run: Run) -> Lead | None:
    """Return by how much the heading of a run leads its course; None where the log does not show it."""
    made = course_of(run, WINDOW_S)
    return None if made is None else _regressed(made.heading - made.course, made.heading, made.rate, made.width)


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
