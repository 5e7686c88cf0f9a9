"""A process that works on one log after the other: one line per task on standard input, one line of rows on standard output.

It is a separate process so that a log that ends it, by memory or by a fault of a library, does not affect others.
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any

from fieldsid.runtime.worker_pool import IS_WORKER

ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", IS_WORKER: "1"}
"""One core for each process, as they share the machine, and no forked workers."""


def worked(task: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of a plain task as plain values; this is the function that a cluster's worker runs."""
    os.environ.update(ENVIRONMENT)
    from fieldsid.artifacts import plain
    from fieldsid.batch.rows import rows_of
    from fieldsid.batch.task import task_of

    rows: list[dict[str, Any]] = plain(rows_of(task_of(task)))
    return rows


def main() -> None:
    """Answer tasks until standard input ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # standard output is for answers: prints of libraries go to standard error
    for line in sys.stdin:
        answers.write(json.dumps(worked(json.loads(line)), allow_nan=False) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
