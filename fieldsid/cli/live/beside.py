"""What a second process works out beside a live estimate: gains of now, and a diagnosis of what was flown when a maneuver ends.

While the fin moves, gains are designed for the recursive estimate. When a maneuver has ended they are designed for the model that
`identify` fits to what was flown since the last jump of authority: then they are those of `schedule design` afterwards. A log
that is replayed without waiting waits for the second process: there nothing flies on.
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
from fieldsid.face.arguments import own_effects, vehicle_of
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
"""Time for which the fin has stayed near its trim when a maneuver has ended."""
MOVED = 0.5
"""Standard errors by which a parameter moves before gains are designed again."""
Flown = Callable[[float, float], "Run | Mapping[str, Any]"]
"""What was flown from one time to another, in s: a run, or columns of canonical names."""


class Beside:
    """Two processes: one designs gains where any are wanted, one diagnoses; `gains` and `diagnosed` are what they said last."""

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

    def hear(self, sample: Sample) -> None:
        """Take a sample's fin: it tells when a maneuver ends."""
        if isfinite(sample.fin):
            self._times.append(sample.time)
            self._fins.append(sample.fin)

    def look(self, now: OnlineEstimate, progress: Progress, *, ended: bool = False) -> None:
        """Take answers up and give what is due; `ended` waits for all of them."""
        self._take(wait=ended)  # what a process is at is of less than was flown by the end
        moved = last_moved(np.array(self._times), np.array(self._fins))
        if self._wanted is not None and not self._designing.is_busy:
            self._design(now, progress, self._wanted(now), moved, ended=ended)
        if self._diagnoses and not self._diagnosing.is_busy and _has_ended(moved, now.time, self._diagnosed, ended=ended):
            self._diagnosed = moved, now.time
            self._diagnosing.give(diagnosed, self._flown(-inf, inf if ended else now.time), self._axis)
        self._take(wait=self._waits or ended)

    def close(self) -> None:
        """End both."""
        self._designing.close()
        self._diagnosing.close()

    def _take(self, *, wait: bool) -> None:
        gains, diagnosed = self._designing.answer(wait=wait), self._diagnosing.answer(wait=wait)
        if gains is not None:
            self.gains = LiveGains(time=nan, **_refused(gains)) if isinstance(gains, FieldsidError) else gains
        if diagnosed is not None:
            is_refused = isinstance(diagnosed, FieldsidError)
            self.diagnosed = LiveDiagnosis(time=nan, **_refused(diagnosed)) if is_refused else diagnosed

    def _design(self, now: OnlineEstimate, progress: Progress, wanted: Wanted, moved: float, *, ended: bool) -> None:
        """Have gains designed where a maneuver has ended, or the estimate says something else than before."""
        of_fit = _has_ended(moved, now.time, self._fitted, ended=ended)
        if not (of_fit or self._is_new(now)):
            return
        try:
            refuse_unsettled(now, progress)
        except DataError as error:
            self.gains = LiveGains(time=now.time, **_refused(error))
            return
        if self.gains is not None and self.gains.verdict == "refused":
            self.gains = None  # what was said of an estimate that had not settled holds no more
        self._designed, since = now, -inf if now.jump is None else now.jump.time
        if of_fit:
            self._fitted = moved, now.time
            self._designing.give(designed_of_fit, now, self._flown(since, inf if ended else now.time), wanted)
        else:
            self._designing.give(designed, now, progress, wanted)

    def _is_new(self, now: OnlineEstimate) -> bool:
        """Whether an estimate says something else than the one that gains were designed for."""
        then = self._designed
        if then is None or then.jump != now.jump:
            return True
        return any(
            abs(v - then.values[n]) > MOVED * now.std_errors[n] or now.std_errors[n] < MOVED * then.std_errors[n]
            for n, v in now.values.items()
        ) or bool(abs(now.speed_now - then.speed_now) > 0.05 * then.speed_now)


def _has_ended(moved: float, now: float, last: tuple[float, float], *, ended: bool) -> bool:
    """Whether a maneuver, in which the fin last moved at a time (s), has ended since the last one, of these times, was taken.

    Where the source has ended all of it counts, as for the command.
    """
    is_due = now != last[1] if ended else moved != last[0] and now - moved >= STILL_S
    return isfinite(moved) and is_due


def wanted_at(axis: Axis, schedule: Path | None, vehicle: Path | None, depth: bool) -> Callable[[OnlineEstimate], Wanted]:
    """Return what gains are wanted at an estimate: as a schedule was designed for, else within the vehicle's limits.

    Raises UsageError for the wrong axis.
    """
    if depth and axis is not Axis.PITCH:
        raise UsageError("depth is held through pitch", found="--axis yaw", hint="write `--axis pitch`")
    if schedule is not None:
        loaded = load_schedule(schedule)
        if loaded.axis is not axis:
            hint = f"write `--axis {loaded.axis.value}`, or name another"
            raise UsageError(f"`{schedule}` is for {loaded.axis.value}, not {axis.value}", found=str(schedule), hint=hint)
        known = wanted_of(loaded)
        return lambda _now: replace(known, depth=known.depth or depth)
    own = vehicle_of(vehicle)
    limit, limits = own.fin_max_rad(axis.value), FinLimits(rate=own.fin_rate_rad_s)
    return lambda now: usual(limit or now.fin_most, by_rate=now.by_rate, limits=limits, depth=depth)


def _refused(error: FieldsidError) -> dict[str, Any]:
    return {"verdict": "refused", "says": f"{error.what} ({error.found})" if error.found else error.what}


def designed(now: OnlineEstimate, progress: Progress, wanted: Wanted) -> LiveGains:
    """Return the gains of an estimate; raises DataError and ModelError as `gains_now` does."""
    return live_gains(now, gains_now(now, progress, wanted))


def designed_of_fit(now: OnlineEstimate, flown: Run | Mapping[str, Any], wanted: Wanted) -> LiveGains:
    """Return the gains of the model that `identify` fits to what was flown; raises what that and the design raise."""
    (fit,) = identify([_read(flown)], now.axis)
    return live_gains(now, gains_of_one(fit.model, now.speed_now, wanted), fit.model.method)


def diagnosed(flown: Run | Mapping[str, Any], axis: Axis) -> LiveDiagnosis:
    """Return what `sysid diagnose` says of what was flown: a run, or columns of canonical names."""
    from fieldsid.cli.headlines.missing import first_line
    from fieldsid.diagnosis import diagnose

    own_effects()
    run = _read(flown)
    found = diagnose([run], axis)
    names, body = ("verdict", "effects", "left", "base", "final", "noise_floor", "next_maneuver"), body_of(found)
    kept = {key: body[key] for key in names}
    return LiveDiagnosis(time=float(run.time[-1]), says=first_line(found), **kept)


def _read(flown: Run | Mapping[str, Any]) -> Run:
    """Return what was flown as a run; columns as they are read from a table."""
    if isinstance(flown, Run):
        return flown
    with TemporaryDirectory() as folder:
        path = Path(folder) / "live.csv"
        table = np.column_stack(list(flown.values()))
        np.savetxt(path, table, fmt="%.12g", delimiter=",", header=",".join(flown), comments="")
        return load_run(path)
