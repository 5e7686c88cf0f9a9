"""The records of runs that are fitted together, those left that can be."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from fieldsid.fitting.checks.closed_loop import refuse_feedback_alone
from fieldsid.fitting.fit import check
from fieldsid.logs.run import Run
from fieldsid.logs.several.sifting import Refused, attempt, sifted
from fieldsid.models.axis import Axis
from fieldsid.models.record import Record, record_of
from fieldsid.runtime.parallel_map import parallel_map


def records_of(groups: Sequence[Sequence[Run]], axis: Axis, unfit: Refused[Run] | None = None) -> list[list[tuple[Run, Record]]]:
    """Return the runs of several groups with their records, without those that no estimator can use.

    unfit is called with each of these, as `sifted` does for each group; without it DataError is raised for the first. It is
    raised where a controller alone moves the fin in every run of the first group, which is fitted; the others are predicted.
    """
    runs = [run for group in groups for run in group]
    if not runs:
        check([], axis)
    made = iter(parallel_map(partial(attempt, partial(_checked, axis=axis)), runs))
    left = [sifted(group, [next(made) for _ in group], unfit) for group in groups]
    refuse_feedback_alone([record for _, record in left[0]])
    return left


def _checked(run: Run, *, axis: Axis) -> Record:
    record = record_of(run, axis)
    check([record], axis)
    return record
