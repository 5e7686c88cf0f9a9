"""The workers of an existing Dask cluster. The logs of a worker that fails are processed by the others.

Logs are submitted a few at a time, to limit the memory of the scheduler and the workers. The workers need fieldsid, and the logs
under the same paths. Source: dask.distributed documentation, resilience.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

from fieldsid.batch.rows import Row, failed_row
from fieldsid.batch.task import Task
from fieldsid.batch.worker import worked
from fieldsid.errors import UsageError

CONNECT_S = 10
AHEAD = 2
"""Number of logs that wait for each thread of a worker."""
LEAST_AHEAD = 8


def run_on_cluster(tasks: Sequence[Task], scheduler: str) -> Iterator[tuple[Task, list[Row]]]:
    """Yield each task with its rows as they come from a cluster's workers.

    Raises UsageError where there is no cluster at the address, or the extra `cluster` is not installed.
    """
    try:
        distributed: Any = import_module("distributed")
    except ImportError as error:
        hint = 'pip install "fieldsid[cluster]"'
        raise UsageError("`--scheduler` needs the extra `cluster`", found=str(error), hint=hint) from error
    try:
        client = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        found, hint = f"{type(error).__name__}: {error}".splitlines()[0], "check the address, `tcp://HOST:8786`"
        raise UsageError(f"there is no Dask scheduler at `{scheduler}`", found=found, hint=hint) from error
    with client:
        threads = sum(client.nthreads().values())
        if not threads:
            raise UsageError(f"the cluster at `{scheduler}` has no workers", found="0 threads", hint=f"`dask worker {scheduler}`")
        waiting, of = iter(tasks), {}
        done = distributed.as_completed(loop=client.loop, raise_errors=False)

        def submit() -> None:
            task = next(waiting, None)
            if task is not None:
                future = client.submit(worked, task.plain(), pure=False, retries=1, key=f"fieldsid-{task.key}")
                of[future] = task
                done.add(future)

        for _ in range(max(LEAST_AHEAD, (1 + AHEAD) * threads)):
            submit()
        for future in done:
            task = of.pop(future)
            yield task, _rows(future, task)
            future.release()
            submit()


def _rows(future: Any, task: Task) -> list[Row]:
    """Return the rows of a finished future; where it has none, the row with the reason."""
    if future.status == "finished":
        rows: list[Row] = future.result()
        return rows
    error = future.exception() if future.status == "error" else None
    found = f"{type(error).__name__}: {error}" if error is not None else str(future.status)
    return [failed_row(task, "failed", "the cluster could not work on it", found, "try it alone: `sysid identify`")]
