"""Find the tables of a folder that belong to one run, and the name of each table in its run.

Loggers that write a file for each kind of message name it by the kind: `EstimatedState.csv`, `run7_state.csv`,
`LOG_attitude_0.csv`. Tables with the same columns belong to several runs if the name of each matches one table of every other
kind, or if each of them has all signals of a run, or if there is no other kind. Otherwise they, and tables with unknown columns,
are several devices of one run.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote

from fieldsid.errors import LogError
from fieldsid.logs.channels import is_enough
from fieldsid.logs.few_of import few_of
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import check_readable
from fieldsid.logs.readers import csv_table, parquet
from fieldsid.logs.run import Note
from fieldsid.logs.several.run_names import name_of_run, names_apart, shared_ends, shared_start, stem_of


def run_of(path: Path, joined: Sequence[Path]) -> list[Path]:
    """Return the tables of one run: those of a folder, or a table and the tables in `joined`.

    Raises LogError where a folder has several runs.
    """
    if joined or not path.is_dir():
        return [path, *joined]
    runs = runs_in(path)
    if len(runs) > 1:
        raise _several(path, runs)
    return runs[0] if runs else []


def runs_in(folder: Path) -> list[list[Path]]:
    """Return the runs of several tables in a folder; none where each of its tables alone is a run."""
    by_header: dict[tuple[str, ...], list[Path]] = {}
    for path in sorted(folder.iterdir()):
        names = _names(path)
        if len(names) > 1:
            by_header.setdefault(names, []).append(path)
    kinds = list(by_header.values())
    signals = {names: _signals(names) for names in by_header}
    complete = [is_enough(signals[names]) for names in by_header]
    if sum(map(len, kinds)) < 2 or all(complete) or any(c for c, kind in zip(complete, kinds, strict=True) if len(kind) > 1):
        return []
    if len(kinds) == 1 and any(signals.values()):
        return []
    marks = [_marks(kind) for kind in kinds]
    if len(kinds) > 1 and len(kinds[0]) > 1 and all(m.keys() == marks[0].keys() for m in marks):
        return [[m[mark] for m in marks] for mark in marks[0]]
    return [sorted(path for kind in kinds for path in kind)]


def tables_beside(path: Path) -> list[Note]:
    """Return a note on the tables in the folder of a table that may be of its run, with the command that joins them."""
    if path.is_dir() or str(path) == "-":
        return []
    runs = runs_in(path.parent)
    same_run = next((run for run in runs if any(table.samefile(path) for table in run)), [])
    others = [table for table in same_run if not table.samefile(path)]
    if not others:
        return []
    files = quote(str(path.parent)) if len(runs) == 1 else " ".join(["--join", *(quote(str(p)) for p in same_run)])
    message = f"beside it lie {few_of([p.name for p in others])}: where they are of the same run, `sysid inspect {files}`"
    return [Note("tables_beside", message, {"tables": [str(p) for p in others]})]


def names_in_run(tables: Sequence[Path]) -> dict[str, Path]:
    """Return the tables by their names in the run: the names of the files without their common start.

    A mapping that uses these names fits every run of the logger.
    """
    stems = [stem_of(path) for path in tables]
    start = len(shared_start(stems)) if len(tables) > 1 else 0
    short = [stem[start:] for stem in stems]
    return dict(zip(names_apart(short if all(short) else stems, tables), tables, strict=True))


def _marks(kind: Sequence[Path]) -> dict[str, Path]:
    """Return tables of one kind by the part of their names that differs."""
    stems = [stem_of(path) for path in kind]
    shared = shared_ends(stems)
    return {shared.middle(stem): path for stem, path in zip(stems, kind, strict=True)}


def _names(path: Path) -> tuple[str, ...]:
    """Return the names of a table's columns; empty for a file that is no table."""
    reader = next((r for r in (csv_table, parquet) if path.name.endswith(r.READER.suffixes)), None)
    if reader is None or path.name.startswith(".") or not path.is_file():
        return ()
    try:
        check_readable(path)
        return reader.names_of(path) if reader.sniff(path) else ()
    except LogError as error:
        if isinstance(error.__cause__, OSError):  # the file cannot be read, so it may be a table
            raise
        return ()


def _signals(names: Sequence[str]) -> set[str]:
    """Return the signals that the names of a table's columns mean."""
    return {found[0] for name in names if (found := meaning_of(name)) is not None and found[0] != TIME}


def _several(folder: Path, runs: Sequence[Sequence[Path]]) -> LogError:
    shown = "; ".join(f"{name_of_run(run)}: {', '.join(p.name for p in run)}" for run in runs[:4])
    first = " ".join(quote(str(p)) for p in runs[0])
    return LogError(
        f"`{folder}` holds {len(runs)} runs of {len(runs[0])} tables each",
        found=shown + ("; ..." if len(runs) > 4 else ""),
        hint=f"one at a time, all with one mapping: `sysid inspect --join {first} --write-mapping mapping.yaml`",
    )
