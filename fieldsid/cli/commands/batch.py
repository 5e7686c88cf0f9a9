"""sysid batch: an archive of logs, each identified and diagnosed: one table with a row for each run."""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit, gated, progress, say
from fieldsid.cli.options import argument, flag, option
from fieldsid.cli.session import draw_figure
from fieldsid.figures.sketch import sketch
from fieldsid.models.axis import Axis
from fieldsid.page import Page, written

if TYPE_CHECKING:
    from fieldsid.batch.archive import Work
    from fieldsid.batch.rows import Row
    from fieldsid.batch.task import Task
    from fieldsid.results.trial import Batch, NotUsed


MOST_REASONS = 8


class Options(options.OfVehicle, options.Mapped):
    """What `sysid batch` takes."""

    logs: list[Path] = argument("LOG...", "Logs, and folders of logs; runs that were imported, too.")
    axis: Axis = options.AXIS
    output: Path = option("-o --output DIR", "Folder of the table and of each log's answer.", default=Path("batch"))
    method: str = options.METHOD
    diagnose: bool = flag("--diagnose/--no-diagnose", "Ask of each run which effect is missing.", default=True)
    whole: bool = flag("--whole", "Take logs as one run each, and use all of it.")
    trend: bool = flag("--trend", "Say and draw where parameters changed over the runs' dates.")
    workers: int | None = option("--workers N", "Processes on this machine; one a core.", min=1)
    scheduler: str | None = option("--scheduler tcp://...", "Work on this Dask cluster (extra `cluster`).")
    timeout: float = option("--timeout S", "Longest time for one log.", default=600.0, min=0.1)
    memory: float = option("--memory MB", "Most memory of one process.", default=4000.0, min=100.0)
    figure: Path | None = options.FIGURE
    force: bool = options.FORCE

    @property
    def has_trend(self) -> bool:
        """Whether the trend is asked for."""
        return self.trend or self.figure is not None


@options.takes(Options)
def command(given: Options) -> Body:
    """Inspect, import, identify and diagnose every log of an archive: one table with a row for each run, Parquet and CSV.

    The same line again goes on where it was stopped; logs that are new or changed are added. A log that cannot be used is a row
    that says why, and the exit code is 1.

    Example: sysid batch archive/ --axis yaw -o batch/ --trend
    """
    from fieldsid.batch.archive import all_rows, without_copies, write_table
    from fieldsid.batch.trend import FEWEST_RUNS, trends_of
    from fieldsid.cli.headlines.trial import headline_of_batch
    from fieldsid.results.trial import Batch

    axis, tasks = given.axis, _tasks(given)
    work, where = _work(given)
    begin = time.monotonic()
    with progress("logs", len(tasks)) as step:
        rows, known = all_rows(given.output, tasks, work, step)
    rows = without_copies(rows)
    parquet, csv = write_table(given.output, axis, rows)
    trends = trends_of([dict(r) for r in rows], axis) if given.has_trend else ()
    place = given.figure or given.output / f"trend_{axis.value}.png"
    plot = sketch("trend", trends, axis.value)
    unusable = [row for row in rows if row["status"] != "done"]
    result = Batch(
        axis=axis,
        logs=len(tasks),
        known_logs=known,
        runs=len(rows) - len(unusable),
        table=str(parquet),
        csv=str(csv),
        where=where,
        seconds=time.monotonic() - begin,
        verdicts=_counts(rows, "verdict"),
        effects=_counts(rows, "effects"),
        skipped_runs=tuple(_unused_log(r) for r in unusable),
        trend=trends,
        figure=draw_figure(place if trends else None, plot, force=given.force or given.figure is None),
    )
    body = emit(result, render=_page(result), headline=headline_of_batch(result, trend=given.trend))
    if given.has_trend and not trends:
        say(f"no trend: fewer than {FEWEST_RUNS} runs of different dates know a parameter of {axis.value}")
    if trends and (dated := sum(row.get("time_from") == "file" for row in rows)):
        say(f"{dated} of {len(rows)} runs have no date in their log: theirs is that of the file's last change")
    return gated(body, failed=bool(unusable))


def _tasks(given: Options) -> list[Task]:
    """Return the task for each log, without the files that an earlier batch wrote to its folder.

    Raises UsageError where none remains, and for an output, a mapping or a vehicle that cannot be used: before the work.
    """
    from fieldsid.batch.task import Settings, Task, logs_in
    from fieldsid.cli.inputs import mapping_of
    from fieldsid.cli.progress import refuse_closed, refuse_figure
    from fieldsid.errors import UsageError
    from fieldsid.vehicle import load_vehicle

    refuse_closed(given.output)
    refuse_figure(given.figure, force=given.force)
    written_by_batch = given.output.resolve()
    logs = [log for log in logs_in(given.logs) if written_by_batch not in log.resolve().parents]
    if not logs:
        raise UsageError("there are no logs here", found="no files", hint="name logs, or a folder that holds some")
    mapping_of(given.mapping)
    if given.vehicle is not None:
        load_vehicle(given.vehicle)
    files = (None if p is None else str(p.resolve()) for p in (given.mapping, given.vehicle))
    settings = Settings(given.axis.value, given.method, given.diagnose, given.whole, *files)
    return [Task(str(log), settings) for log in logs]


def _counts(rows: Sequence[Row], column: str) -> dict[str, int]:
    """Return how many rows have each word of a column, the most frequent first."""
    return dict(Counter(r[column] for r in rows if r.get(column)).most_common())


def _work(given: Options) -> tuple[Work, str]:
    """Return the function that works on the tasks, in local processes or on a Dask cluster, and its place in words."""
    if (scheduler := given.scheduler) is not None:
        from fieldsid.batch.dask_cluster import run_on_cluster

        return partial(run_on_cluster, scheduler=scheduler), scheduler
    from fieldsid.batch.local_pool import run_here

    cores = len(os.sched_getaffinity(0)) if sys.platform.startswith("linux") else os.cpu_count()
    count = given.workers or cores or 1
    said = f"{count} process{'es' * (count != 1)} of this machine"
    return partial(run_here, workers=count, timeout_s=given.timeout, memory_mb=given.memory), said


def _unused_log(row: Row) -> NotUsed:
    from fieldsid.results.trial import NotUsed

    what, found, hint = (str(row.get(k) or "") for k in ("what", "found", "hint"))
    return NotUsed(row["run"], row["log"], what, found, hint, row["status"])


def _page(result: Batch) -> Page:
    from fieldsid.figures.trend import lines_of

    reasons: dict[str, list[str]] = {}  # messages, by their text without the names of file and run
    for row in result.skipped_runs:
        reasons.setdefault(row.what.replace(row.file, "").replace(row.run, ""), []).append(row.what)
    lines = [line for t in result.trend for line in lines_of(t)]
    shown = [(messages[0], len(messages) - 1) for messages in list(reasons.values())[:MOST_REASONS]]
    lines += [f"not used: {message}" + (f"; the same of {more} more" if more else "") for message, more in shown]
    if len(reasons) > MOST_REASONS:
        lines.append(f"and for {len(reasons) - MOST_REASONS} other reasons: see the column `what`")
    return Page("", closing=(*lines, *written(table=f"{result.table} and {result.csv}", figure=result.figure)))
