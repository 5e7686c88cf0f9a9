"""Goal steps that an autopilot flew, each compared with the prediction of a verification for the same step and speed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fieldsid.display import Brief
from fieldsid.errors import DataError
from fieldsid.logs.run import Run
from fieldsid.models.axis import NAMES
from fieldsid.models.record import knows_speed
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Key, Number
from fieldsid.schedule.check import StepCheck
from fieldsid.schedule.flown.response import FLIGHT_ERROR_SHARE, SETTLING_BAND, overshoot, settling, steady_error
from fieldsid.schedule.plants import Plants
from fieldsid.schedule.record import Schedule
from fieldsid.schedule.verify import STEPS_RAD, promised_step

SMOOTH_S = 0.5
"""Time over which the angle is averaged before its overshoot is measured, so that peaks of the sensor noise do not count."""
MIN_STD_ERRORS = 3.0
"""Standard errors of the sensor noise by which a number must exceed the prediction to count as worse."""


@dataclass(frozen=True, slots=True)
class FlownStep:
    """The result of a step that was flown: overshoot as a share of the step, settling (s, inf if never), steady error (rad)."""

    overshoot: Annotated[Number, Key("Overshoot of the angle averaged over half a second.", "overshoot_percent", times=100.0)]
    settling: Annotated[Number, Key("Time to stay within 5 %; null if it was not there at the end of the step.", "settling_s")]
    steady_error: Annotated[Number, Key("What was asked less where it came to rest.", "steady_error_rad")]


@dataclass(frozen=True, slots=True, repr=False)
class KeptStep(Brief):
    """One goal step as flown and as predicted; `noise` (rad) is that of the averaged angle."""

    run: Annotated[str, Key("Name of the run.")]
    start: Annotated[float, Key("When the goal changed.", "t_start_s")]
    seconds: Annotated[float, Key("How long the goal was held.", "held_s")]
    speed: Annotated[float, Key("Median speed of the step.", "speed_m_s")]
    size: Annotated[float, Key("From the angle then to the goal.", "step_rad")]
    flown: Annotated[FlownStep, Key("What was flown.")]
    noise: float
    promised: Annotated[StepCheck, Key("What a verification says of this step at this speed.")]

    @property
    def broken(self) -> Annotated[tuple[str, ...], Key()]:
        """The numbers that are worse than in 95 % of the draws; settling does not count for a step that ended before that."""
        f, p, slack = self.flown, self.promised, MIN_STD_ERRORS * self.noise
        worse = {
            "overshoot": f.overshoot > p.overshoot_most + FLIGHT_ERROR_SHARE + slack / abs(self.size),
            "settling": f.settling > p.settling_most and self.seconds > p.settling_most,
            "steady error": abs(f.steady_error) > p.off + slack,
        }
        return tuple(name for name, is_worse in worse.items() if is_worse)

    @property
    def as_promised(self) -> Annotated[bool, Key()]:
        """Whether none is."""
        return not self.broken


def kept_steps(schedule: Schedule, of: Plants, run: Run) -> list[KeptStep]:
    """Return the goal steps in a run as flown and as predicted; raises DataError where there is none."""
    names = NAMES[schedule.axis]
    if not (run.has(names.goal) and run.has(names.angle)):
        raise DataError(
            f"`{run.name}` does not say what the autopilot was told to hold",
            found=f"signals {', '.join(n for n in run.signals if run.has(n))}",
            hint=f"map `{names.goal}` and `{names.angle}` on import",
        )
    found = [
        _compared_step(schedule, of, run, *part)
        for part in _goal_intervals(run.time, run[names.goal], STEPS_RAD[schedule.axis][0] / 2)
    ]
    if not found:
        least = np.degrees(STEPS_RAD[schedule.axis][0] / 2)
        raise DataError(
            f"`{run.name}` has no step of `{names.goal}`",
            found=f"no change of {least:.1f} deg",
            hint="fly steps, and import them",
        )
    return found


def _goal_intervals(time: FloatArray, goal: FloatArray, least: float) -> Iterator[tuple[int, int]]:
    """Yield the first and last sample of each interval of constant goal after a change of at least `least` rad."""
    known = np.flatnonzero(np.isfinite(goal))
    changed = [int(known[0]), *(int(known[i + 1]) for i in np.flatnonzero(np.abs(np.diff(goal[known])) > 1e-9)), time.size]
    for before, start, end in zip(changed, changed[1:], changed[2:], strict=False):
        if abs(goal[start] - goal[before]) >= least and time[end - 1] - time[start] > 2.0 * SMOOTH_S:
            yield start, end


def _compared_step(schedule: Schedule, of: Plants, run: Run, start: int, end: int) -> KeptStep:
    names = NAMES[schedule.axis]
    time, angle = run.time[start:end] - run.time[start], run[names.angle][start:end]
    goal = float(run[names.goal][start])
    ok = np.isfinite(angle)
    time, angle = time[ok], angle[ok]
    width = max(1, round(SMOOTH_S / float(np.median(np.diff(time)))))
    smooth = np.convolve(np.pad(angle, (width // 2, width - 1 - width // 2), mode="edge"), np.full(width, 1.0 / width), "valid")
    noise = float(np.std(np.diff(angle)) / np.sqrt(2.0 * width))
    size = goal - float(smooth[0])
    moved = np.sign(size) * (smooth - smooth[0])[:, None]
    surge = run["surge_m_s"][start:end] if knows_speed(run) else np.full(2, schedule.speeds[0])
    speed = float(np.nanmedian(surge))
    band = SETTLING_BAND + MIN_STD_ERRORS * noise / abs(size)
    flown = FlownStep(
        overshoot=float(overshoot(moved, abs(size))[0]),
        settling=float(settling(time, moved, abs(size), band)[0]),
        steady_error=float(steady_error(moved, abs(size))[0]),
    )
    promised = promised_step(schedule, of, speed, float(smooth[0]), size, float(time[-1]))
    return KeptStep(run.name, float(run.time[start]), float(time[-1]), speed, size, flown, noise, promised)


def worst_of(steps: Sequence[KeptStep]) -> KeptStep:
    """Return the step with the most numbers worse than predicted, among equals the one with the largest overshoot."""
    return max(steps, key=lambda s: (len(s.broken), s.flown.overshoot))
