"""The records of those runs of a joint fit that an estimator can use."""

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
    """Return the runs of several groups with their records, without the runs that no estimator can use.

    `unfit` is called with each run left out, see `sifted`; without `unfit` the first such run raises DataError. DataError is
    also raised where a controller moves the fin in every run of the first group. The first group is to be fitted, the others
    are only predicted.
    """
    runs = [run for group in groups for run in group]
    if not runs:
        check([], axis)
    attempts = iter(parallel_map(partial(attempt, partial(_checked_record, axis=axis)), runs))
    usable = [sifted(group, [next(attempts) for _ in group], unfit) for group in groups]
    refuse_feedback_alone([record for _, record in usable[0]])
    return usable


def _checked_record(run: Run, *, axis: Axis) -> Record:
    record = record_of(run, axis)
    check([record], axis)
    return record
