"""What a second process works out beside a live estimate: gains of now, and a diagnosis of what was flown when a maneuver ends.

A log that is replayed without waiting waits for it instead: there nothing flies on.
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
from fieldsid.face.arguments import fin_rate_of, own_effects, vehicle_of
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
from fieldsid.schedule import FinLimits, load_schedule
from fieldsid.schedule.search.of_one_model import Wanted, usual, wanted_of

STILL_S = 5.0
"""Time for which the fin has stayed near its trim when a maneuver has ended."""
MOVED = 0.5
"""Standard errors by which a parameter moves before gains are designed again."""
Flown = Callable[[float], "Run | Mapping[str, Any]"]


class Beside:
    """Two processes: one designs gains, one diagnoses; `gains` and `diagnosed` are what they said last."""

    def __init__(
        self, axis: Axis, flown: Flown | None, wanted: Callable[[OnlineEstimate], Wanted] | None, *, waits: bool
    ) -> None:
        self._axis, self._flown, self._wanted, self._waits = axis, flown, wanted, waits
        self._designing, self._diagnosing = SecondProcess(), SecondProcess()
        self._times, self._fins, self._judged = array("d"), array("d"), (nan, nan)
        self._designed: OnlineEstimate | None = None
        self.gains: LiveGains | None = None
        self.diagnosed: LiveDiagnosis | None = None

    def hear(self, sample: Sample) -> None:
        """Take a sample's fin: it tells when a maneuver ends."""
        if self._flown is not None and isfinite(sample.fin):
            self._times.append(sample.time)
            self._fins.append(sample.fin)

    def look(self, now: OnlineEstimate, progress: Progress, *, ended: bool = False) -> None:
        """Take answers up and give what is due; `ended` waits for all of them."""
        self._take(wait=ended)  # what a process is at is of less than was flown by the end
        if self._wanted is not None and not self._designing.is_busy and (ended or self._is_new(now)):
            self._design(now, progress, self._wanted)
        if self._flown is not None and not self._diagnosing.is_busy:
            self._diagnose(now, self._flown, ended=ended)
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

    def _design(self, now: OnlineEstimate, progress: Progress, wanted: Callable[[OnlineEstimate], Wanted]) -> None:
        try:
            refuse_unsettled(now, progress)
        except DataError as error:
            self.gains = LiveGains(time=now.time, **_refused(error))
            return
        if self.gains is not None and self.gains.verdict == "refused":
            self.gains = None  # what was said of an estimate that had not settled holds no more
        self._designed = now
        self._designing.give(designed, now, progress, wanted(now))

    def _is_new(self, now: OnlineEstimate) -> bool:
        """Whether an estimate says something else than the one that gains were designed for."""
        then = self._designed
        if then is None or then.jump != now.jump:
            return True
        return any(
            abs(v - then.values[n]) > MOVED * now.std_errors[n] or now.std_errors[n] < MOVED * then.std_errors[n]
            for n, v in now.values.items()
        ) or bool(abs(now.speed_now - then.speed_now) > 0.05 * then.speed_now)

    def _diagnose(self, now: OnlineEstimate, flown: Flown, *, ended: bool) -> None:
        moved = last_moved(np.array(self._times), np.array(self._fins))
        judged, until = self._judged
        # in the end all of it is told of, as the command does
        is_due = now.time != until if ended else moved != judged and now.time - moved >= STILL_S
        if not isfinite(moved) or not is_due:
            return
        self._judged = moved, now.time
        self._diagnosing.give(diagnosed, flown(inf if ended else now.time), self._axis)


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
    limit = None if own is None else own.fin_max_rad(axis.value)
    limits = FinLimits(rate=fin_rate_of(own))
    return lambda now: usual(limit or now.fin_most, by_rate=now.by_rate, limits=limits, depth=depth)


def _refused(error: FieldsidError) -> dict[str, Any]:
    return {"verdict": "refused", "says": f"{error.what} ({error.found})" if error.found else error.what}


def designed(now: OnlineEstimate, progress: Progress, wanted: Wanted) -> LiveGains:
    """Return the gains of an estimate; raises DataError and ModelError as `gains_now` does."""
    return live_gains(now, gains_now(now, progress, wanted))


def diagnosed(flown: Run | Mapping[str, Any], axis: Axis) -> LiveDiagnosis:
    """Return what `sysid diagnose` says of what was flown: a run, or columns of canonical names."""
    from fieldsid.cli.headlines.missing import first_line
    from fieldsid.diagnosis import diagnose

    own_effects()
    run = flown if isinstance(flown, Run) else _read(flown)
    found = body_of(diagnose([run], axis))
    kept = {key: found[key] for key in ("verdict", "effects", "left", "base", "final", "noise_floor", "next_maneuver")}
    return LiveDiagnosis(time=float(run.time[-1]), says=first_line(found), **kept)


def _read(columns: Mapping[str, Any]) -> Run:
    """Return the run of columns as it is read from a table."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "live.csv"
        table = np.column_stack(list(columns.values()))
        np.savetxt(path, table, fmt="%.12g", delimiter=",", header=",".join(columns), comments="")
        return load_run(path)
