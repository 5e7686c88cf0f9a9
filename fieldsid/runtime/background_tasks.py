"""Work whose only result is on the disk, done by forked workers while this process goes on."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Self

from fieldsid.runtime.worker_pool import Worker, fork_worker

MAX_WORKERS = 2
"""Largest number of workers that run at a time."""


class BackgroundTasks:
    """Tasks in forked workers, waited for where the context is left; a task that failed there is done again here.

    So its error is raised here. Where the context is left with an error, no task is done again.
    """

    def __init__(self) -> None:
        self._tasks: list[tuple[Worker, Callable[[], None]]] = []

    def run(self, task: Callable[[], None]) -> None:
        """Do a task in a worker; here, at once, where MAX_WORKERS are running or this process cannot be forked."""
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
