"""A process that works on one log after the other: a task a line on standard input, its rows a line on standard output.

A process of its own, so that a log that ends it, by memory or by a library's fault, ends no other.
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any

from fieldsid.runtime.worker_pool import IS_WORKER

ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", IS_WORKER: "1"}
"""One core for each: the processes share the machine, and none of them makes copies of itself."""


def worked(task: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of a plain task as plain values; what a cluster's worker is given to do."""
    os.environ.update(ENVIRONMENT)
    from fieldsid.artifacts import plain
    from fieldsid.batch.rows import rows_of
    from fieldsid.batch.task import task_of

    rows: list[dict[str, Any]] = plain(rows_of(task_of(task)))
    return rows


def main() -> None:
    """Answer tasks until there are no more."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a library prints is no answer
    for line in sys.stdin:
        answers.write(json.dumps(worked(json.loads(line)), allow_nan=False) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
