"""The part of a run worth fitting: steady, excitation, recovery.

From 2 s before the fin first clearly leaves its trim to 10 s after it last came back. A controller's small work on
the fin around its trim is not excitation: an excursion is above a quarter of the largest one, above half a degree and
above four times the fin's usual activity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fieldsid.errors import DataError, UsageError
from fieldsid.logs.convert.settling import settling_of
from fieldsid.logs.run import Run
from fieldsid.numerics.arrays import BoolArray, FloatArray

BEFORE_S = 2.0
AFTER_S = 10.0
LEAST_RAD = 0.0087
"""Half a degree: what is below is no excitation."""
SHARE_OF_LARGEST = 0.25
ACTIVITY = 4.0
WHOLE = 0.8
"""A run whose excitation covers more than this share of it is taken whole."""
STEADY_S = 1.0
"""Time at the start over which the trim is read."""

YAW = "yaw"
_FINS = {YAW: ("rudder_measured_rad", "rudder_rad"), "pitch": ("elevator_measured_rad", "elevator_rad")}


@dataclass(frozen=True, slots=True)
class Segment:
    """A part of a run, in s, and why it was chosen."""

    start_s: float
    end_s: float
    why: str

    def of(self, run: Run) -> Run:
        """Return the run between the two times."""
        return run.between(self.start_s, self.end_s)


def segment(run: Run, axis: str) -> Segment:
    """Return the part of a run that excites an axis (`yaw` or `pitch`).

    Raises DataError when the log has no fin for the axis, or the fin never leaves its trim.
    """
    signal = _fin_of(run, axis)
    if signal is None:
        raise no_fin(run, axis, _FINS[axis][1])
    time, fin = _seen(run, signal)
    away, limit = excursions(run.name, axis, signal, time, fin, _answer_of(run))
    return _around(run, time, away, signal, limit)


def is_excited(run: Run, axis: str) -> bool:
    """Whether a run has a fin for an axis (`yaw` or `pitch`) that leaves its trim."""
    signal = _fin_of(run, axis)
    return signal is not None and bool(_away(*_seen(run, signal))[0].any())


def excited_axis(runs: Sequence[Run], *, written: str) -> str:
    """Return the axis (`yaw` or `pitch`) that runs excite; `written` is how one is chosen, `{axis}` in it.

    Raises UsageError where they excite both or none, DataError where they have no fin for either.
    """
    if not any(_fin_of(run, axis) for run in runs for axis in _FINS):
        raise DataError(
            "no run has a fin signal",
            found=", ".join(sorted({k for run in runs for k in run.signals if run.has(k)})) or "no signals",
            hint="map `rudder_rad` or `elevator_rad` on import",
        )
    excited = {axis: sum(is_excited(run, axis) for run in runs) for axis in _FINS}
    found = [axis for axis, count in excited.items() if count]
    if len(found) == 1:
        return found[0]
    has_fin = {axis: any(_fin_of(run, axis) for run in runs) for axis in _FINS}
    seen = ", ".join(
        f"{axis} in {count} of {len(runs)}" if has_fin[axis] else f"no fin for {axis} (`{_FINS[axis][1]}`)"
        for axis, count in excited.items()
    )
    lacking = next((_FINS[axis][1] for axis in _FINS if not has_fin[axis]), None)
    otherwise = "or fly an excitation" if lacking is None else f"or map `{lacking}` on import"
    choice = "write " + " or ".join(written.format(axis=axis) for axis in _FINS if has_fin[axis])
    raise UsageError(
        "the runs excite both axes, and one is identified at a time" if found else "no fin in the runs leaves its trim",
        found=f"a fin clearly away from its trim: {seen}",
        hint=choice if found else f"{choice}, {otherwise}",
    )


def plane_of(runs: Sequence[Run]) -> str:
    """Return the axis that most runs excite, of several the one that more have a fin of, then yaw."""
    return max(_FINS, key=lambda a: (sum(is_excited(run, a) for run in runs), sum(_fin_of(run, a) is not None for run in runs)))


def may_show(run: Run, axis: str) -> bool:
    """Whether a run may show something of an axis: unless it excites the other one alone."""
    return is_excited(run, axis) or not any(is_excited(run, other) for other in _FINS)


def _fin_of(run: Run, axis: str) -> str | None:
    """Return the signal of an axis' fin, the command where both are there; None where there is none."""
    return next((s for s in reversed(_FINS[axis]) if run.has(s)), None)


def _seen(run: Run, signal: str) -> tuple[FloatArray, FloatArray]:
    """Return times and values of a signal where it was measured."""
    seen = np.isfinite(run[signal])
    return run.time[seen], run[signal][seen]


class Answer(NamedTuple):
    """What turns behind a fin: time (n,) s, and a rate (n,) rad/s, or an angle (n,) rad."""

    time: FloatArray
    values: FloatArray
    is_angle: bool


def _answer_of(run: Run) -> Answer | None:
    """Return the heading's rate of a run, its heading without one; None where neither was measured."""
    signal = next((s for s in ("yaw_rate_rad_s", "yaw_rad") if run.has(s)), None)
    return None if signal is None else Answer(*_seen(run, signal), is_angle=signal == "yaw_rad")


def excursions(
    name: str, axis: str, signal: str, time: FloatArray, fin: FloatArray, answer: Answer | None = None
) -> tuple[BoolArray, float]:
    """Return where the fin (n,) rad of a run is clearly away from its trim, and the limit in rad.

    Raises DataError where it never is: such a run says nothing of what a fin does, but for what the heading's answer to a step
    before it tells.
    """
    away, limit = _away(time, fin)
    if away.any():
        return away, limit
    low, high = np.degrees(fin.min()), np.degrees(fin.max())
    middle = float(np.median(fin))
    tells = _settling(answer, middle) if axis == YAW and np.ptp(fin) < LEAST_RAD < abs(middle) else ""
    if tells:
        raise DataError(
            f"`{signal}` of run {name!r} stands at {np.degrees(middle):.2f} deg throughout: its step is before the first sample",
            found=f"{time[-1] - time[0]:.3g} s at {low:.2f} to {high:.2f} deg; {tells}",
            hint="log some seconds before the step, or the step back as well: at one angle C0 and the fin's part are one number",
        )
    raise DataError(
        f"`{signal}` of run {name!r} never leaves its trim: constant within {high - low:.2f} deg",
        found=f"{low:.2f} to {high:.2f} deg (limit {np.degrees(limit):.2f} deg from trim)",
        hint=f"leave that run out, or fly an excitation: `sysid plan --axis {axis}`",
    )


def _settling(answer: Answer | None, fin: float) -> str:
    """Return in words what a heading's settling at one fin angle in rad tells, where it tells anything."""
    found = None if answer is None else settling_of(answer.time, np.unwrap(answer.values), integrated=answer.is_angle)
    if found is None:
        return ""
    pole, rate = found
    return f"the rate settles by a22 = {pole:.3g} 1/s, and with C0 = 0 assumed b2 is {pole * rate / fin:.3g} 1/s^2"


def no_fin(run: Run, axis: str, missing: str) -> DataError:
    """Return the error of a run without a fin for an axis; its hint names the other axis where that one has one."""
    other = next(a for a in _FINS if a != axis)
    hint = f"map `{missing}` on import"
    if any(run.has(fin) for fin in _FINS[other]):
        hint += f", or take the other axis, for which it has a fin: `--axis {other}`, or a model of {other}"
    return DataError(
        f"run {run.name!r} has no fin signal for {axis}: `{missing}` is missing or empty",
        found=", ".join(k for k in run.signals if run.has(k)) or "no signals",
        hint=hint,
    )


def _away(time: FloatArray, fin: FloatArray) -> tuple[BoolArray, float]:
    trim = float(np.median(fin[time <= time[0] + STEADY_S]))
    off = np.abs(fin - trim)
    quiet = off[off < SHARE_OF_LARGEST * off.max()] if off.max() > 0 else off
    # The median of what is small anyway, so that a long excitation does not raise its own limit.
    activity = float(np.median(quiet)) if quiet.size else 0.0
    limit = max(LEAST_RAD, SHARE_OF_LARGEST * float(off.max()), ACTIVITY * activity)
    return off > limit, limit


def last_moved(time: FloatArray, fin: FloatArray) -> float:
    """Return when a fin (n,) rad was last clearly away from its trim, NaN where it never was; time (n,) s."""
    away = np.flatnonzero(_away(time, fin)[0]) if time.size else np.empty(0, dtype=np.intp)
    return float(time[away[-1]]) if away.size else float("nan")


def _around(run: Run, time: FloatArray, away: BoolArray, signal: str, limit: float) -> Segment:
    moved = np.flatnonzero(away)
    first, last = float(time[moved[0]]), float(time[moved[-1]])
    begin, end = float(run.time[0]), float(run.time[-1])
    if last - first >= WHOLE * (end - begin):
        return Segment(begin, end, f"the whole run: `{signal}` is away from trim from {first:.2f} to {last:.2f} s")
    # a log whose samples are further apart keeps at least the one before and the one after
    step = float(np.median(np.diff(run.time)))
    start, stop = max(begin, first - max(BEFORE_S, step)), min(end, last + max(AFTER_S, step))
    why = (
        f"{first - start:.3g} s before `{signal}` first leaves its trim by {np.degrees(limit):.1f} deg ({first:.2f} s) "
        f"to {stop - last:.3g} s after it last did ({last:.2f} s)"
    )
    return Segment(start, stop, why)
