"""sysid batch: an archive of logs, each identified and diagnosed: one table with a row for each run."""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.console import emit, progress, say
from fieldsid.cli.exit_codes import GATE_FAILED
from fieldsid.cli.options import AxisOption, FigureFile, Force, MappingFile, Method, VehicleFile, argument, flag, option
from fieldsid.cli.session import draw_figure
from fieldsid.figures.sketch import sketch
from fieldsid.page import Page, written

if TYPE_CHECKING:
    from fieldsid.batch.archive import Work
    from fieldsid.results.trial import Batch, NotUsed


MOST_REASONS = 8


def command(
    logs: Annotated[list[Path], argument("LOG...", "Logs, and folders of logs; runs that were imported, too.")],
    axis: AxisOption,
    output: Annotated[Path, option("-o --output", "DIR", "Folder of the table and of each log's answer.")] = Path("batch"),
    method: Method = "auto",
    diagnose: Annotated[bool, flag("--diagnose/--no-diagnose", "Ask of each run which effect is missing.")] = True,
    whole: Annotated[bool, flag("--whole", "Take logs as one run each, and use all of it.")] = False,
    trend: Annotated[bool, flag("--trend", "Say and draw where parameters changed over the runs' dates.")] = False,
    workers: Annotated[int | None, option("--workers", "N", "Processes on this machine; one a core.", min=1)] = None,
    scheduler: Annotated[str | None, option("--scheduler", "tcp://...", "Work on this Dask cluster (extra `cluster`).")] = None,
    timeout: Annotated[float, option("--timeout", "S", "Longest time for one log.", min=0.1)] = 600.0,
    memory: Annotated[float, option("--memory", "MB", "Most memory of one process.", min=100.0)] = 4000.0,
    mapping: MappingFile = None,
    vehicle: VehicleFile = None,
    figure: FigureFile = None,
    force: Force = False,
) -> Mapping[str, Any]:
    """Inspect, import, identify and diagnose every log of an archive: one table with a row for each run, Parquet and CSV.

    The same line again goes on where it was stopped; logs that are new or changed are added. A log that cannot be used is a row
    that says why, and the exit code is 1.

    Example: sysid batch archive/ --axis yaw -o batch/ --trend
    """
    from fieldsid.batch.archive import all_rows, without_copies, write_table
    from fieldsid.batch.task import Settings, Task, logs_in
    from fieldsid.batch.trend import trends_of
    from fieldsid.cli.inputs import mapping_of
    from fieldsid.cli.progress import refuse_closed, refuse_figure
    from fieldsid.results.trial import Batch

    refuse_closed(output)
    refuse_figure(figure, force=force)
    found = _logs(logs_in(logs), output)
    mapping_of(mapping)
    if vehicle is not None:
        from fieldsid.vehicle import load_vehicle

        load_vehicle(vehicle)
    settings = Settings(
        axis.value, method, diagnose, whole, *(None if p is None else str(p.resolve()) for p in (mapping, vehicle))
    )
    tasks = [Task(str(log), settings) for log in found]
    work, where = _work(workers, scheduler, timeout, memory)
    begin = time.monotonic()
    with progress("logs", len(tasks)) as step:
        rows, known = all_rows(output, tasks, work, step)
    rows = without_copies(rows)
    parquet, csv = write_table(output, axis, rows)
    trends = trends_of([dict(r) for r in rows], axis) if trend or figure is not None else ()
    place = figure or output / f"trend_{axis.value}.png"
    plot = sketch("trend", trends, axis.value)
    drawn = draw_figure(place if trends else None, plot, force=force or figure is None)
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
        verdicts=dict(Counter(r["verdict"] for r in rows if r.get("verdict")).most_common()),
        effects=dict(Counter(r["effects"] for r in rows if r.get("effects")).most_common()),
        skipped_runs=tuple(_unused_log(r) for r in unusable),
        trend=trends,
        figure=drawn,
    )
    from fieldsid.cli.headlines.trial import headline_of_batch

    body = emit(result, render=_page(result), headline=headline_of_batch(result, trend=trend))
    if (trend or figure is not None) and not trends:
        say(f"no trend: fewer than 6 runs of different dates know a parameter of {axis.value}")
    if trends and (dated := sum(row.get("time_from") == "file" for row in rows)):
        say(f"{dated} of {len(rows)} runs have no date in their log: theirs is that of the file's last change")
    if unusable:
        raise typer.Exit(GATE_FAILED)
    return body


def _logs(found: Sequence[Path], output: Path) -> list[Path]:
    """Return the logs without the files that an earlier batch wrote to its folder; raises UsageError where none remains."""
    from fieldsid.errors import UsageError

    written_by_batch = output.resolve()
    remaining = [log for log in found if written_by_batch not in log.resolve().parents]
    if not remaining:
        raise UsageError("there are no logs here", found="no files", hint="name logs, or a folder that holds some")
    return remaining


def _work(workers: int | None, scheduler: str | None, timeout: float, memory: float) -> tuple[Work, str]:
    """Return the function that works on the tasks, in local processes or on a Dask cluster, and its place in words."""
    from functools import partial

    if scheduler is not None:
        from fieldsid.batch.dask_cluster import run_on_cluster

        return partial(run_on_cluster, scheduler=scheduler), scheduler
    from fieldsid.batch.local_pool import run_here

    cores = len(os.sched_getaffinity(0)) if sys.platform.startswith("linux") else os.cpu_count()
    count = workers or cores or 1
    said = f"{count} process{'es' * (count != 1)} of this machine"
    return partial(run_here, workers=count, timeout_s=timeout, memory_mb=memory), said


def _unused_log(row: Mapping[str, Any]) -> NotUsed:
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
