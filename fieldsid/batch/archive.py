"""A batch as a folder: the answer for each log in a separate file as soon as it is computed, and the table of all answers.

A batch that was stopped can be continued: logs with an answer are not processed again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from fieldsid._version import __version__
from fieldsid.artifacts import plain, replacing, write_text
from fieldsid.batch.rows import Row, columns
from fieldsid.batch.task import Task
from fieldsid.errors import ArtifactError
from fieldsid.models.axis import Axis
from fieldsid.records.check import Shape, at_least_one, check, text
from fieldsid.records.reading import read_json, read_text

SCHEMA = "fieldsid/batch-log/1"
ANSWERS = "logs"
ANSWER: Shape = {"schema": text, "rows": at_least_one({"status": text})}
"""The shape of a log's answer, without the columns of its rows."""

Work = Callable[[Sequence[Task]], Iterator[tuple[Task, list[Row]]]]


def known_rows(folder: Path, task: Task) -> list[Row] | None:
    """Return the rows of an earlier batch for a task; None where there are none or the task failed."""
    path = _answer_path(folder, task)
    try:
        body = read_json(read_text(path))
        check(body, ANSWER)
    except (ArtifactError, ValueError):
        return None
    rows: list[Row] = body["rows"]
    if body["schema"] != SCHEMA or any(r["status"] == "failed" or not all(map(_has_type_of_column, r, r.values())) for r in rows):
        return None
    return rows


def _has_type_of_column(name: str, value: object) -> bool:
    """Whether a cell of a row has the type of its column: text or number."""
    is_shown = any(name in columns(axis) for axis in Axis)
    return not is_shown or value is None or isinstance(value, str if name in _WORDS else (int, float))


def all_rows(folder: Path, tasks: Sequence[Task], work: Work, done: Callable[[], None]) -> tuple[list[Row], int]:
    """Return the rows of all tasks in order, computing and storing the missing ones, and the number of logs already known."""
    found = {task: rows for task in tasks if (rows := known_rows(folder, task)) is not None}
    known = len(found)
    for _ in range(known):
        done()
    for task, rows in work([task for task in tasks if task not in found]):
        body = {"schema": SCHEMA, "tool": f"fieldsid {__version__}", "task": task.plain(), "rows": plain(rows)}
        write_text(_answer_path(folder, task), json.dumps(body, allow_nan=False), force=True)
        found[task] = rows
        done()
    return [row for task in tasks for row in found[task]], known


def without_copies(rows: Sequence[Row]) -> list[Row]:
    """Return the rows with those of a log that is a copy of an earlier one as skipped: one flight must not count twice."""
    first: dict[str, str] = {}
    out: list[Row] = []
    for row in rows:
        log, digest = row["log"], row.get("sha256")
        original = log if digest is None else first.setdefault(digest, log)
        what = f"`{log}` is a copy of `{original}`"
        kept = {name: row[name] for name in ("log", "run", "sha256", "tool") if name in row}
        out.append(row if original == log else kept | {"status": "skipped", "what": what, "found": "", "hint": "leave it out"})
    return out


def write_table(folder: Path, axis: Axis, rows: Iterable[Row]) -> tuple[Path, Path]:
    """Write the table as Parquet and as CSV, each completely or not at all; raises ArtifactError."""
    import pandas as pd

    names = columns(axis)
    frame = pd.DataFrame([{n: row.get(n) for n in names} for row in rows], columns=list(names))
    words = {n for n in names if n in _WORDS}
    frame = frame.astype({n: "string" if n in words else "float64" for n in names})
    parquet, table = folder / f"batch_{axis.value}.parquet", folder / f"batch_{axis.value}.csv"
    with replacing(parquet, force=True) as temporary:
        frame.to_parquet(temporary, index=False)
    cells = {n: frame[n].map(_escaped_formula, na_action="ignore") for n in words}
    with replacing(table, force=True) as temporary:
        frame.assign(**cells).to_csv(temporary, index=False)
    return parquet, table


def _escaped_formula(text: str) -> str:
    """Return a text as a cell that a spreadsheet does not take for a formula."""
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", "\r")) else text


_WORDS = frozenset(
    ("log", "run", "status", "start_utc", "time_from", "verdict", "effects", "method", "findings", "warnings", "says", "what",
     "found", "hint", "sha256", "tool")
)  # fmt: skip


def _answer_path(folder: Path, task: Task) -> Path:
    return folder / ANSWERS / f"{task.key}.json"
