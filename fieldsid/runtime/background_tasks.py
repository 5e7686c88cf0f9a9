"""Work whose only result is on the disk, done by forked workers in the background."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Self

from fieldsid.runtime.worker_pool import Worker, fork_worker

MAX_WORKERS = 2
"""Largest number of workers that run at a time."""


class BackgroundTasks:
    """Tasks in forked workers, for which the end of the context waits; a task that failed there is repeated in this process.

    Its error is thus raised here. Where the context ends with an error, no task is repeated.
    """

    def __init__(self) -> None:
        self._tasks: list[tuple[Worker, Callable[[], None]]] = []

    def run(self, task: Callable[[], None]) -> None:
        """Run a task in a worker, or here at once where MAX_WORKERS are running or this process cannot be forked."""
        busy = sum(worker.is_running() for worker, _ in self._tasks)
        worker = fork_worker(lambda: _no_bytes(task)) if busy < MAX_WORKERS else None
        if worker is None:
            task()
        else:
            self._tasks.append((worker, task))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, error: object, *_more: object) -> None:
        tasks, self._tasks = self._tasks, []
        with ExitStack() as workers:
            for worker, _ in tasks:
                workers.enter_context(worker)
            for worker, task in tasks:
                if worker.answer() is None and error is None:
                    task()


def _no_bytes(task: Callable[[], None]) -> bytes:
    task()
    return b""
