"""From runs to fits, one each or one for all: the function behind `sysid identify`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from fieldsid.errors import UsageError
from fieldsid.fitting.checks.closed_loop import refuse_feedback_alone
from fieldsid.fitting.checks.run_checks import offset_findings, run_checks, sign_findings
from fieldsid.fitting.checks.sampling_checks import sampling_findings
from fieldsid.fitting.fit import AUTO, Fit, check, check_signals, fit
from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
from fieldsid.fitting.problem.estimator import Options
from fieldsid.logs import Note, Run, segment
from fieldsid.logs.several.sifting import Refused, attempt, sifted
from fieldsid.models.axis import Axis
from fieldsid.models.record import Record, record_of
from fieldsid.vehicle import Vehicle


def identify(
    runs: Sequence[Run],
    axis: Axis,
    *,
    method: str = AUTO,
    effects: Sequence[str] = (),
    joint: bool = False,
    whole: bool = False,
    options: Options | None = None,
    vehicle: Vehicle | None = None,
    done: Callable[[], None] = lambda: None,
    unfit: Refused[Run] | None = None,
) -> tuple[Fit, ...]:
    """Return one fit per run, or a single fit of all runs when joint; `done` is called after each fit.

    Of each run the part that excites the axis is used (logs/segments.py), or the entire run when `whole`.
    `vehicle` states the fin's limit and the side to which a positive fin turns. `unfit` is called with each of several runs that
    cannot be fitted, and the others are fitted; without `unfit`, for a single run, and where no run can be fitted, the error of
    the run is raised.
    Raises DataError for runs that do not allow the fit, UsageError for a method that takes neither the effects nor several runs,
    and for a joint fit of several runs of which only one can be used.
    """

    def checked(run: Run) -> _CheckedRun:
        part = run if whole else segment(run, axis).of(run)
        record = record_of(part, axis)
        check([record], axis)
        check_signals([record], effects)
        return _CheckedRun(run, record, run_checks(part, axis, vehicle))

    def fitted(group: Sequence[_CheckedRun]) -> Fit:
        records = [j.record for j in group]
        refuse_feedback_alone(records)
        found = fit(records, axis, method=method, effects=effects, options=options)
        done()
        model_notes = (
            *sampling_findings(found.model, records, goodness_of_fit(found.predictions), found.floor),
            *sign_findings(found.model, vehicle),
            *offset_findings(found.model, vehicle),
        )
        notes = (*model_notes, *(note for j in group for note in j.notes))
        return replace(found, notes=(*notes, *found.notes))

    ready = [j for _, j in sifted(runs, (attempt(checked, run) for run in runs), unfit)]
    if joint:
        check_joint([j.run.name for j in ready], len(runs))
        return (fitted(ready),)
    usable_runs = [j.run for j in ready]
    return tuple(found for _, found in sifted(usable_runs, (attempt(fitted, [j]) for j in ready), unfit))


def check_joint(usable: Sequence[str], total: int) -> None:
    """Raise UsageError where only one of several runs can be used: its single fit would be another model than the joint one."""
    if total > 1 and len(usable) == 1:
        raise UsageError(
            f"a joint fit needs two runs, and 1 of {total} can be used",
            found=f"{usable[0]!r}",
            hint="leave `--joint` out to fit that one alone",
        )


@dataclass(frozen=True, slots=True)
class _CheckedRun:
    """A run that can be fitted, its record, and the notes of the run checks."""

    run: Run
    record: Record
    notes: tuple[Note, ...]
