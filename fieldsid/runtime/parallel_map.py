"""A map shared with a forked worker: this process and the worker each take the next item that remains."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from fieldsid.runtime.pickling import dumps, loads
from fieldsid.runtime.worker_pool import fork_worker, job_queue

T = TypeVar("T")
R = TypeVar("R")

MAX_ITEMS = 256
"""Number of items above which a map is not shared: the number of an item is one byte."""


def parallel_map(
    function: Callable[[T], R], items: Sequence[T],
    write: Callable[[dict[int, Any]], bytes] = dumps, read: Callable[[bytes], dict[int, Any]] = loads,
) -> list[R]:  # fmt: skip
    """Return function(item) of every item, in order.

    Side effects of the function occur in one of the two processes only: every result must be in the value that it returns.
    `write` and `read` convert the values, by the index of the items, to bytes and back. Where the worker ends without an answer,
    its items are evaluated here; an error of the function is raised here.
    """
    done = _shared_values(function, items, write, read) if 1 < len(items) <= MAX_ITEMS else {}
    return [done[i] if i in done else function(item) for i, item in enumerate(items)]


def _shared_values(
    function: Callable[[T], R], items: Sequence[T],
    write: Callable[[dict[int, Any]], bytes], read: Callable[[bytes], dict[int, Any]],
) -> dict[int, R]:  # fmt: skip
    """Return the values computed by this process and a worker, by the index of the items; empty where there is no worker."""
    remaining = job_queue(len(items))
    try:
        worker = fork_worker(lambda: write(dict(_evaluate_next(function, items, remaining))))
        if worker is None:
            return {}
        with worker:
            own = dict(_evaluate_next(function, items, remaining))
            answer = worker.answer()
    finally:
        os.close(remaining)
    return own if answer is None else own | read(answer)


def _evaluate_next(function: Callable[[T], R], items: Sequence[T], remaining: int) -> Iterator[tuple[int, R]]:
    """Yield the indices and values of the items that this process takes."""
    while number := os.read(remaining, 1):
        yield number[0], function(items[number[0]])
