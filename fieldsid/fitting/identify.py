"""From runs to fits, one each or one for all: the function behind `sysid identify`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from fieldsid.errors import UsageError
from fieldsid.fitting.checks.closed_loop import refuse_feedback_alone
from fieldsid.fitting.checks.run_checks import offset_findings, run_checks, sign_findings
from fieldsid.fitting.checks.sampling_checks import sampling_findings
from fieldsid.fitting.fit import AUTO, Fit, check, check_signals, fit
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
    """Return one fit per run, or a single one over all of them when joint; `done` is called after each.

    Of each run the part is used that excites the axis (logs/segments.py), or all of it when `whole`.
    A vehicle gives the fin's limit and the side a positive fin turns to. unfit is called with each of several runs that cannot be
    fitted, and the others are fitted; without it, for a single run, and where none is left, its error is raised.
    Raises DataError for runs that do not allow the fit, UsageError for a method that cannot do what is asked, and for a joint
    fit of which one run is left.
    """

    def judged(run: Run) -> _Judged:
        part = run if whole else segment(run, axis).of(run)
        record = record_of(part, axis)
        check([record], axis)
        check_signals([record], effects)
        return _Judged(run, record, run_checks(part, axis, vehicle))

    def fitted(group: Sequence[_Judged]) -> Fit:
        records = [j.record for j in group]
        refuse_feedback_alone(records)
        found = fit(records, axis, method=method, effects=effects, options=options)
        done()
        of_model = (
            *sampling_findings(found.model, records),
            *sign_findings(found.model, vehicle),
            *offset_findings(found.model, vehicle),
        )
        notes = (*of_model, *(note for j in group for note in j.notes))
        return replace(found, notes=(*notes, *found.notes))

    ready = [j for _, j in sifted(runs, (attempt(judged, run) for run in runs), unfit)]
    if joint:
        check_joint([j.run.name for j in ready], len(runs))
        return (fitted(ready),)
    alone = [j.run for j in ready]
    return tuple(found for _, found in sifted(alone, (attempt(fitted, [j]) for j in ready), unfit))


def check_joint(left: Sequence[str], given: int) -> None:
    """Raise UsageError where of several runs for a joint fit one is left: its own fit is another model than the one asked for."""
    if given > 1 and len(left) == 1:
        raise UsageError(
            f"a joint fit needs two runs, and 1 of {given} can be used",
            found=f"{left[0]!r}",
            hint="leave `--joint` out to fit that one alone",
        )


@dataclass(frozen=True, slots=True)
class _Judged:
    """A run that can be fitted, its record, and what speaks against it."""

    run: Run
    record: Record
    notes: tuple[Note, ...]
