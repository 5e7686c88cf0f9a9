"""The analysis of a live estimate in other processes: gains for the present speed, and a diagnosis after each maneuver.

While the fin moves, gains are designed for the recursive estimate. When a maneuver has ended, they are designed for the model
that `identify` fits to the data flown since the last jump of the fin's authority; these gains equal those of `schedule design`
on the same data. A replay at full speed (`--speed 0`) waits for each answer: its log would otherwise end before the first one.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf, isfinite, nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fieldsid.errors import DataError, FieldsidError, UsageError
from fieldsid.face.arguments import load_user_effects, vehicle_of
from fieldsid.fitting.identify import identify
from fieldsid.logs.load import load_run
from fieldsid.logs.run import Run
from fieldsid.logs.segments import last_moved
from fieldsid.models.axis import Axis
from fieldsid.online.estimate import OnlineEstimate
from fieldsid.online.identifier import gains_now, refuse_unsettled
from fieldsid.online.look import LiveDiagnosis, LiveGains, live_gains
from fieldsid.online.progress import Progress
from fieldsid.online.samples import Sample
from fieldsid.records.keys import body_of
from fieldsid.runtime.second_process import SecondProcess
from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.record import load_schedule
from fieldsid.schedule.search.of_one_model import Wanted, gains_of_one, usual, wanted_of

STILL_S = 5.0
"""Time for which the fin must stay near its trim before a maneuver counts as ended."""
LEAST_CHANGE = 0.5
"""Change of a parameter, in standard errors, at which gains are designed again."""
Flown = Callable[[float, float], "Run | Mapping[str, Any]"]
"""Returns the data flown between two times in s: a run, or columns by canonical signal name."""


class BackgroundAnalysis:
    """Two processes, one that designs gains where any are wanted and one that diagnoses.

    `gains` and `diagnosed` are their latest answers. wanted: returns what gains to design for an estimate; None for no gains.
    waits: `update` waits for the answers.
    """

    def __init__(
        self, axis: Axis, flown: Flown, wanted: Callable[[OnlineEstimate], Wanted] | None, *, diagnoses: bool, waits: bool
    ) -> None:
        self._axis, self._flown, self._wanted, self._diagnoses, self._waits = axis, flown, wanted, diagnoses, waits
        self._designing, self._diagnosing = SecondProcess(), SecondProcess()
        self._times, self._fins = array("d"), array("d")
        self._fitted = self._diagnosed = (nan, nan)
        self._designed: OnlineEstimate | None = None
        self.gains: LiveGains | None = None
        self.diagnosed: LiveDiagnosis | None = None

    def add(self, sample: Sample) -> None:
        """Record a sample's fin angle, by which the end of a maneuver is recognised."""
        if isfinite(sample.fin):
            self._times.append(sample.time)
            self._fins.append(sample.fin)

    def update(self, now: OnlineEstimate, progress: Progress, *, ended: bool = False) -> None:
        """Collect the answers that are ready and start the analyses that are due; ended: the source has ended, wait for all."""
        self._collect(wait=ended)  # an analysis under way at the end has not seen the last samples: another follows
        moved = last_moved(np.array(self._times), np.array(self._fins))
        if self._wanted is not None and not self._designing.is_busy:
            self._design(now, progress, self._wanted(now), moved, ended=ended)
        if self._diagnoses and not self._diagnosing.is_busy and _has_ended(moved, now.time, self._diagnosed, ended=ended):
            self._diagnosed = moved, now.time
            self._diagnosing.give(diagnose_flown, self._flown(-inf, inf if ended else now.time), self._axis)
        self._collect(wait=self._waits or ended)

    def close(self) -> None:
        """End both processes."""
        self._designing.close()
        self._diagnosing.close()

    def _collect(self, *, wait: bool) -> None:
        """Store the answers of both processes; an error becomes a record that says it was refused."""
        gains, diagnosed = self._designing.answer(wait=wait), self._diagnosing.answer(wait=wait)
        if gains is not None:
            self.gains = LiveGains(time=nan, **_refusal(gains)) if isinstance(gains, FieldsidError) else gains
        if diagnosed is not None:
            is_refused = isinstance(diagnosed, FieldsidError)
            self.diagnosed = LiveDiagnosis(time=nan, **_refusal(diagnosed)) if is_refused else diagnosed

    def _design(self, now: OnlineEstimate, progress: Progress, wanted: Wanted, moved: float, *, ended: bool) -> None:
        """Start a design of gains where a maneuver has ended, or the estimate has changed since the last design."""
        has_ended = _has_ended(moved, now.time, self._fitted, ended=ended)
        if not (has_ended or self._is_changed(now)):
            return
        try:
            refuse_unsettled(now, progress)
        except DataError as error:
            self.gains = LiveGains(time=now.time, **_refusal(error))
            return
        if self.gains is not None and self.gains.verdict == "refused":
            self.gains = None  # the refusal was of an estimate that had not settled
        self._designed, since = now, -inf if now.jump is None else now.jump.time
        if has_ended:
            self._fitted = moved, now.time
            self._designing.give(fit_and_design, now, self._flown(since, inf if ended else now.time), wanted)
        else:
            self._designing.give(design, now, progress, wanted)

    def _is_changed(self, now: OnlineEstimate) -> bool:
        """Whether an estimate differs from the one of the last design: in a value, a standard error, the speed or a jump."""
        then = self._designed
        if then is None or then.jump != now.jump:
            return True
        return any(
            abs(v - then.values[n]) > LEAST_CHANGE * now.std_errors[n] or now.std_errors[n] < LEAST_CHANGE * then.std_errors[n]
            for n, v in now.values.items()
        ) or bool(abs(now.speed_now - then.speed_now) > 0.05 * then.speed_now)


def _has_ended(moved: float, now: float, last: tuple[float, float], *, ended: bool) -> bool:
    """Whether a maneuver that was not analysed yet has ended: the fin last moved at `moved` (s) and has been still for STILL_S.

    last: the time of the last fin motion, and the time of the estimate, at the last analysis. At the end of the source every
    sample counts, as in the command that reads the whole log.
    """
    is_due = now != last[1] if ended else moved != last[0] and now - moved >= STILL_S
    return isfinite(moved) and is_due


def wanted_at(axis: Axis, schedule: Path | None, vehicle: Path | None, depth: bool) -> Callable[[OnlineEstimate], Wanted]:
    """Return a function that gives the wanted gains for an estimate: as the schedule was designed, else by the vehicle's limits.

    Raises UsageError for a schedule of the other axis, and for a depth loop in yaw.
    """
    if depth and axis is not Axis.PITCH:
        raise UsageError("depth is held through pitch", found="--axis yaw", hint="write `--axis pitch`")
    if schedule is not None:
        loaded = load_schedule(schedule)
        if loaded.axis is not axis:
            hint = f"write `--axis {loaded.axis.value}`, or name another"
            raise UsageError(f"`{schedule}` is for {loaded.axis.value}, not {axis.value}", found=str(schedule), hint=hint)
        wanted = wanted_of(loaded)
        return lambda _now: replace(wanted, depth=wanted.depth or depth)
    known_vehicle = vehicle_of(vehicle)
    limit, limits = known_vehicle.fin_max_rad(axis.value), FinLimits(rate=known_vehicle.fin_rate_rad_s)
    return lambda now: usual(limit or now.fin_most, by_rate=now.by_rate, limits=limits, depth=depth)


def _refusal(error: FieldsidError) -> dict[str, Any]:
    return {"verdict": "refused", "says": f"{error.what} ({error.found})" if error.found else error.what}


def design(now: OnlineEstimate, progress: Progress, wanted: Wanted) -> LiveGains:
    """Return the gains for an estimate; raises DataError and ModelError as `gains_now` does."""
    return live_gains(now, gains_now(now, progress, wanted))


def fit_and_design(now: OnlineEstimate, flown: Run | Mapping[str, Any], wanted: Wanted) -> LiveGains:
    """Return the gains for the model that `identify` fits to the data flown; raises as that and the design do."""
    (fit,) = identify([_run_of(flown)], now.axis)
    return live_gains(now, gains_of_one(fit.model, now.speed_now, wanted), fit.model.method)


def diagnose_flown(flown: Run | Mapping[str, Any], axis: Axis) -> LiveDiagnosis:
    """Return the diagnosis of the data flown, as `sysid diagnose` makes it; flown: a run, or columns by canonical name."""
    from fieldsid.cli.headlines.missing import first_line
    from fieldsid.diagnosis import diagnose

    load_user_effects()
    run = _run_of(flown)
    found = diagnose([run], axis)
    names, body = ("verdict", "effects", "left", "base", "final", "noise_floor", "next_maneuver"), body_of(found)
    shown = {key: body[key] for key in names}
    return LiveDiagnosis(time=float(run.time[-1]), says=first_line(found), **shown)


def _run_of(flown: Run | Mapping[str, Any]) -> Run:
    """Return the data flown as a run; columns are written to a table and read back, as a log of them would be."""
    if isinstance(flown, Run):
        return flown
    with TemporaryDirectory() as folder:
        path = Path(folder) / "live.csv"
        table = np.column_stack(list(flown.values()))
        np.savetxt(path, table, fmt="%.12g", delimiter=",", header=",".join(flown), comments="")
        return load_run(path)
