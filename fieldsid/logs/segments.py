"""The part of a run that is fitted: steady start, excitation and recovery.

It begins 2 s before the fin first clearly leaves its trim and ends 10 s after it last did. Small fin angles of a controller
about the trim are not excitation: an excursion is larger than a quarter of the largest one, than half a degree and than four
times the usual activity of the fin.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fieldsid.errors import DataError, UsageError
from fieldsid.logs.convert.settling import settling_of
from fieldsid.logs.few_of import few_of
from fieldsid.logs.run import MEASURED_FIN, Run
from fieldsid.numerics.arrays import BoolArray, FloatArray

BEFORE_S = 2.0
AFTER_S = 10.0
LEAST_RAD = math.radians(0.5)
"""A smaller excursion is not excitation."""
MOVED = 0.25
"""Share of the largest excursion of a fin, or of its range, from which on a change is a movement."""
ACTIVITY = 4.0
WHOLE = 0.8
"""Share of a run from which on its excitation is long enough for the complete run to be used."""
STEADY_S = 1.0
"""Time at the start over which the trim is the median of the fin angle."""

YAW = "yaw"
_FINS = dict(zip((YAW, "pitch"), MEASURED_FIN.items(), strict=True))


@dataclass(frozen=True, slots=True)
class Segment:
    """A part of a run: its start and end in s, and the reason for the choice."""

    start_s: float
    end_s: float
    why: str

    def of(self, run: Run) -> Run:
        """Return the part of a run between the two times."""
        return run.between(self.start_s, self.end_s)


def segment(run: Run, axis: str) -> Segment:
    """Return the part of a run that excites an axis (`yaw` or `pitch`).

    Raises DataError where the log has no fin for the axis, or the fin never leaves its trim.
    """
    signal = _fin_of(run, axis)
    if signal is None:
        raise no_fin(run, axis, _FINS[axis][0])
    time, fin = _finite_samples(run, signal)
    away, limit = excursions(run.name, axis, signal, time, fin, _answer_of(run))
    return _segment_around(run, time, away, signal, limit)


def is_excited(run: Run, axis: str) -> bool:
    """Whether a run has a fin for an axis (`yaw` or `pitch`) that leaves its trim."""
    signal = _fin_of(run, axis)
    return signal is not None and bool(_excursion_mask(*_finite_samples(run, signal))[0].any())


def excited_axis(runs: Sequence[Run], *, written: str) -> str:
    """Return the axis (`yaw` or `pitch`) that the runs excite; `written` is how the user chooses one, with `{axis}` in it.

    Raises UsageError where they excite both axes or none, DataError where they have no fin for either.
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
        f"{axis} in {count} of {len(runs)}" if has_fin[axis] else f"no fin for {axis} (`{_FINS[axis][0]}`)"
        for axis, count in excited.items()
    )
    lacking = next((_FINS[axis][0] for axis in _FINS if not has_fin[axis]), None)
    otherwise = "or fly an excitation" if lacking is None else f"or map `{lacking}` on import"
    choice = "write " + " or ".join(written.format(axis=axis) for axis in _FINS if has_fin[axis])
    raise UsageError(
        "the runs excite both axes, and one is identified at a time" if found else "no fin in the runs leaves its trim",
        found=f"a fin clearly away from its trim: {seen}",
        hint=choice if found else f"{choice}, {otherwise}",
    )


def plane_of(runs: Sequence[Run]) -> str:
    """Return the axis that most runs excite; in a tie the axis with a fin in more runs, then yaw."""
    return max(_FINS, key=lambda a: (sum(is_excited(run, a) for run in runs), sum(_fin_of(run, a) is not None for run in runs)))


def may_show(run: Run, axis: str) -> bool:
    """Return whether a run may be informative on an axis: false only where it excites the other axis alone."""
    return is_excited(run, axis) or not any(is_excited(run, other) for other in _FINS)


def _fin_of(run: Run, axis: str) -> str | None:
    """Return the signal of the fin of an axis, the command where command and measurement exist; None where neither does."""
    return next((s for s in _FINS[axis] if run.has(s)), None)


def _finite_samples(run: Run, signal: str) -> tuple[FloatArray, FloatArray]:
    """Return the times and values of the finite samples of a signal."""
    seen = np.isfinite(run[signal])
    return run.time[seen], run[signal][seen]


class Answer(NamedTuple):
    """The response of the heading to the fin: time (n,) in s, and a rate (n,) in rad/s or an angle (n,) in rad."""

    time: FloatArray
    values: FloatArray
    is_angle: bool


def _answer_of(run: Run) -> Answer | None:
    """Return the yaw rate r of a run, or without it the heading; None where neither was measured."""
    signal = next((s for s in ("yaw_rate_rad_s", "yaw_rad") if run.has(s)), None)
    return None if signal is None else Answer(*_finite_samples(run, signal), is_angle=signal == "yaw_rad")


def excursions(
    name: str, axis: str, signal: str, time: FloatArray, fin: FloatArray, answer: Answer | None = None
) -> tuple[BoolArray, float]:
    """Return the mask (n,) of the samples at which the fin (n,) in rad is clearly away from its trim, and the limit in rad.

    Raises DataError where it never is: such a run is not informative on the fin. Where the fin is constant at an angle, the
    error states the a22 and b2 that the settling of the yaw rate after an earlier step shows.
    """
    away, limit = _excursion_mask(time, fin)
    if away.any():
        return away, limit
    low, high = np.degrees(fin.min()), np.degrees(fin.max())
    middle = float(np.median(fin))
    settling_text = _settling_text(answer, middle) if axis == YAW and np.ptp(fin) < LEAST_RAD < abs(middle) else ""
    if settling_text:
        raise DataError(
            f"`{signal}` of run {name!r} stands at {np.degrees(middle):.2f} deg throughout: its step is before the first sample",
            found=f"{time[-1] - time[0]:.3g} s at {low:.2f} to {high:.2f} deg; {settling_text}",
            hint="log some seconds before the step, or the step back as well: at one angle C0 and the fin's part are one number",
        )
    raise DataError(
        f"`{signal}` of run {name!r} never leaves its trim: constant within {high - low:.2f} deg",
        found=f"{low:.2f} to {high:.2f} deg (limit {np.degrees(limit):.2f} deg from trim)",
        hint=f"leave that run out, or fly an excitation: `sysid plan --axis {axis}`",
    )


def _settling_text(answer: Answer | None, fin: float) -> str:
    """Return, in words, a22 and b2 from the settling of the yaw rate at a constant fin angle (rad); empty where it shows none."""
    found = None if answer is None else settling_of(answer.time, np.unwrap(answer.values), integrated=answer.is_angle)
    if found is None:
        return ""
    pole, rate = found
    return f"the rate settles by a22 = {pole:.3g} 1/s, and with C0 = 0 assumed b2 is {pole * rate / fin:.3g} 1/s^2"


def no_fin(run: Run, axis: str, missing: str) -> DataError:
    """Return the error of a run without a fin for an axis; its hint names the columns not used, and the axis with a fin."""
    other = next(a for a in _FINS if a != axis)
    unused = [f"`{column}`" for n in run.notes if n.code == "ignored_columns" for column in n.data["columns"]]
    hint = f"map `{missing}` on import" + (f": not used of the log are {few_of(unused)}" if unused else "")
    if any(run.has(fin) for fin in _FINS[other]):
        hint += f", or take the other axis, for which it has a fin: `--axis {other}`, or a model of {other}"
    return DataError(
        f"run {run.name!r} has no fin signal for {axis}: `{missing}` is missing or empty",
        found=", ".join(k for k in run.signals if run.has(k)) or "no signals",
        hint=hint,
    )


def _excursion_mask(time: FloatArray, fin: FloatArray) -> tuple[BoolArray, float]:
    trim = float(np.median(fin[time <= time[0] + STEADY_S]))
    off = np.abs(fin - trim)
    quiet = off[off < MOVED * off.max()] if off.max() > 0 else off
    # The median of the small deviations only, so that a long excitation does not raise its own limit.
    activity = float(np.median(quiet)) if quiet.size else 0.0
    limit = max(LEAST_RAD, MOVED * float(off.max()), ACTIVITY * activity)
    return off > limit, limit


def last_moved(time: FloatArray, fin: FloatArray) -> float:
    """Return the time at which a fin (n,) in rad was last clearly away from its trim, NaN where it never was; time (n,) in s."""
    away = np.flatnonzero(_excursion_mask(time, fin)[0]) if time.size else np.empty(0, dtype=np.intp)
    return float(time[away[-1]]) if away.size else float("nan")


def _segment_around(run: Run, time: FloatArray, away: BoolArray, signal: str, limit: float) -> Segment:
    moved = np.flatnonzero(away)
    first, last = float(time[moved[0]]), float(time[moved[-1]])
    begin, end = float(run.time[0]), float(run.time[-1])
    if last - first >= WHOLE * (end - begin):
        return Segment(begin, end, f"the whole run: `{signal}` is away from trim from {first:.2f} to {last:.2f} s")
    # where the sampling interval is longer, keep at least one sample before and one after
    step = float(np.median(np.diff(run.time)))
    start, stop = max(begin, first - max(BEFORE_S, step)), min(end, last + max(AFTER_S, step))
    why = (
        f"{first - start:.3g} s before `{signal}` first leaves its trim by {np.degrees(limit):.1f} deg ({first:.2f} s) "
        f"to {stop - last:.3g} s after it last did ({last:.2f} s)"
    )
    return Segment(start, stop, why)
