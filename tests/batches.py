"""A batch worked on in this process: the processes that it starts are asked for in tests/unit/batch/test_pools.py."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from unittest.mock import patch

from fieldsid.batch import local_pool
from fieldsid.batch.rows import Row
from fieldsid.batch.task import Task
from fieldsid.batch.worker import worked


def _one_by_one(tasks: Sequence[Task], workers: int, *, timeout_s: float, memory_mb: float) -> Iterator[tuple[Task, list[Row]]]:
    for task in tasks:
        with patch.dict(os.environ):  # a worker's own settings are no other command's
            rows = worked(task.plain())
        yield task, rows


@contextmanager
def in_this_process() -> Iterator[None]:
    """Work on the logs of a batch here, one after the other, as a worker does."""
    with patch.object(local_pool, "run_here", _one_by_one):
        yield
