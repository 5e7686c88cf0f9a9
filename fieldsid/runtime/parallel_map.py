"""A map shared with a worker that is forked for it: this process and the worker each take the next item left."""

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

    What the function changes is seen in one of the two processes only: all that matters must be in the value it returns, which
    `write` and `read`, by the place of the items, turn to bytes and back. Where the worker ends without an answer, its items are
    evaluated here; an error of the function is raised here.
    """
    done = _shared(function, items, write, read) if 1 < len(items) <= MAX_ITEMS else {}
    return [done[i] if i in done else function(item) for i, item in enumerate(items)]


def _shared(
    function: Callable[[T], R], items: Sequence[T],
    write: Callable[[dict[int, Any]], bytes], read: Callable[[bytes], dict[int, Any]],
) -> dict[int, R]:  # fmt: skip
    """Return what this process and a worker have worked out, by the place of the items; nothing where there is no worker."""
    left = job_queue(len(items))
    try:
        worker = fork_worker(lambda: write(dict(_taken(function, items, left))))
        if worker is None:
            return {}
        with worker:
            own = dict(_taken(function, items, left))
            answer = worker.answer()
    finally:
        os.close(left)
    return own if answer is None else own | read(answer)


def _taken(function: Callable[[T], R], items: Sequence[T], left: int) -> Iterator[tuple[int, R]]:
    """Yield the places and values of the items that this process takes."""
    while number := os.read(left, 1):
        yield number[0], function(items[number[0]])
