"""Runs as commands take them: files of any known format, and `-` for a CSV on standard input."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.copies import copied, read_back, written
from fieldsid.errors import UsageError

if TYPE_CHECKING:
    from fieldsid.logs.run import Run

STDIN = Path("-")
READING = ("pandas", "pyarrow")
"""What takes most of the time of reading the first log. Once it is here a copy of the process has nothing to save."""


def read_runs(
    paths: Sequence[Path],
    *,
    mapping: Path | None = None,
    start: float | None = None,
    end: float | None = None,
    meanwhile: Callable[[], None] | None = None,
) -> list[Run]:
    """Return the runs of the files, each with a name of its own, cut to `start` .. `end` s where given.

    meanwhile: what this process does while a copy of it reads the files, where there can be one and this process has not read
    any before. Raises LogError for a file that cannot be read, DataError where the cut leaves nothing.
    """
    if list(paths).count(STDIN) > 1:
        raise UsageError("standard input can be read once", found="`-` twice", hint="save the second log to a file")
    pays = STDIN not in paths and not any(library in sys.modules for library in READING)
    known = _read_beside(paths, mapping, meanwhile) if meanwhile is not None and pays else None
    runs = _apart(known or [_read(path, mapping) for path in paths], paths)
    if start is None and end is None:
        return runs
    return [run.between(-float("inf") if start is None else start, float("inf") if end is None else end) for run in runs]


def read_run(path: Path, *, mapping: Path | None = None) -> Run:
    """Return the run of one file; raises LogError."""
    return _read(path, mapping)


def files_of(runs: Sequence[Run]) -> list[Path]:
    """Return the files the runs came from, for the hashes in what is written; standard input has none."""
    return [run.source for run in runs if run.source is not None and run.source.exists()]


def _read(path: Path, mapping: Path | None) -> Run:
    from fieldsid.logs import load_run

    return load_run(path, mapping)


def _read_beside(paths: Sequence[Path], mapping: Path | None, meanwhile: Callable[[], None]) -> list[Run] | None:
    """Return the runs as a copy of this process read them; None where it did not: an error is met again, and told, here."""
    copy = copied(lambda: written([_read(path, mapping) for path in paths]))
    if copy is None:
        return None
    with copy:
        meanwhile()
        answer = copy.answer()
    return None if answer is None else read_back(answer)


def _apart(runs: list[Run], paths: Sequence[Path]) -> list[Run]:
    """Put the folder's name before the names that several files share."""
    count = Counter(run.name for run in runs)
    named = [
        run if count[run.name] == 1 else replace(run, name=f"{path.resolve().parent.name}_{run.name}")
        for run, path in zip(runs, paths, strict=True)
    ]
    again = [name for name, n in Counter(run.name for run in named).items() if n > 1]
    if again:
        raise UsageError(f"run {again[0]!r} is given twice", found=", ".join(map(str, paths)), hint="give each run once")
    return named
