"""From runs to fits, one each or one for all: the function behind `sysid identify`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from fieldsid.fitting.fit import AUTO, Fit, fit
from fieldsid.fitting.judge_run import run_findings, sign_findings
from fieldsid.fitting.method import Options
from fieldsid.logs import Run, segment
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of
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
) -> tuple[Fit, ...]:
    """Return one fit per run, or a single one over all of them when joint; `done` is called after each.

    Of each run the part is used that excites the axis (logs/segments.py), or all of it when `whole`.
    A vehicle gives the fin's limit and the side a positive fin turns to.
    Raises DataError for runs that do not allow the fit, UsageError for a method that cannot do what is asked.
    """
    parts = runs if whole else [segment(run, axis).of(run) for run in runs]
    records = [record_of(part, axis) for part in parts]
    judged = [run_findings(part, axis, vehicle) for part in parts]
    groups = [list(range(len(runs)))] if joint else [[i] for i in range(len(runs))]
    fits = []
    for group in groups:
        found = fit([records[i] for i in group], axis, method=method, effects=effects, options=options)
        notes = (*sign_findings(found.model, vehicle), *(note for i in group for note in judged[i]))
        fits.append(replace(found, notes=(*notes, *found.notes)))
        done()
    return tuple(fits)
