"""Runs from what a user passes: files, patterns, pandas tables, runs."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from glob import glob, has_magic
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeGuard, cast

from fieldsid.errors import LogError, UsageError
from fieldsid.face.arguments import File, vehicle_of
from fieldsid.face.several import Several
from fieldsid.logs import ChannelMap, Run
from fieldsid.logs.convert.assemble import WHOLE, part_between
from fieldsid.logs.convert.conditioning import MAX_GAP_S
from fieldsid.logs.importing import Importer
from fieldsid.logs.reader import neighbours
from fieldsid.logs.several.run_names import runs_apart
from fieldsid.records.named_inputs import mapping_of

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.vehicle import Vehicle

Log: TypeAlias = "Run | DataFrame | str | PathLike[str]"
Logs: TypeAlias = "Log | Iterable[Log] | Mapping[str, DataFrame]"


@dataclass(frozen=True, slots=True)
class Reading:
    """How logs are read, which part of each, and the fin limits (rad) they are judged by."""

    importer: Importer = field(default_factory=lambda: Importer(whole=True))
    fin_max_rad: Mapping[str, float] = field(default_factory=dict)

    def of_file(self, path: Path) -> list[Run]:
        """Return the run of a file, or where not all of it is wanted its stretches under way."""
        return self.importer.read(path, self.fin_max_rad)

    def of_table(self, table: DataFrame, name: str) -> Run:
        """Return the run of a pandas table."""
        from fieldsid.logs.mapping.mapping_file import channel_of
        from fieldsid.logs.pandas_table import run_of_frame

        how = self.importer
        return run_of_frame(
            table, name, how.mapping, channels=dict(map(channel_of, how.channels)), salvage=how.salvage, max_gap_s=how.max_gap_s,
            part=how.part, fin_max_rad=self.fin_max_rad,
        )  # fmt: skip

    def of_run(self, run: Run) -> Run:
        """Return the part of a run that was read before."""
        return run if self.importer.part == WHOLE else run.between(*self.importer.part)


def load(
    logs: Logs,
    *,
    mapping: ChannelMap | File | None = None,
    channel: Sequence[str] = (),
    msg_path: File | None = None,
    vehicle: Vehicle | File | None = None,
    start: float | None = None,
    end: float | None = None,
    max_gap: float = MAX_GAP_S,
    salvage: bool = False,
    whole: bool = False,
    join: bool = False,
) -> Several[Run]:
    """Return the runs of logs, as `sysid import` reads them: files, patterns as `runs/*.parquet`, pandas tables.

    A table has one row per sample; a dictionary of tables names their runs. channel: `SIGNAL=COLUMN:UNIT`, as with `--channel`.
    vehicle: gives the fin limits by which saturation is found. start, end: the part of every run, in s. max_gap: the longest gap,
    in s. salvage: read the intact part of a damaged log. whole: return one run for each file; without it each stretch under way
    is a run. join: the files are the tables of one run, as with `--join`. Raises LogError for a file that is missing or cannot
    be read and for a pattern without a file, MappingError where no column is known, DataError where the part is empty,
    UsageError for an object that is no log.
    """
    files = _tables_of_one_run(logs) if join else []
    importer = Importer(
        loaded_mapping(mapping),
        tuple(channel),
        None if msg_path is None else Path(msg_path),
        part_between(start, end),
        max_gap,
        salvage,
        whole,
        joined=tuple(files[1:]),
    )
    return runs_of(files[0] if files else logs, Reading(importer, vehicle_of(vehicle).signal_limits))


def _tables_of_one_run(logs: Logs) -> list[Path]:
    """Return the table files of one run in order; raises UsageError for anything but files, LogError for an unmatched pattern."""
    named = [logs] if isinstance(logs, (str, PathLike)) else list(cast("Iterable[Log]", logs))
    other = next((item for item in named if not isinstance(item, (str, PathLike))), None)
    if other is not None:
        raise UsageError("only files are joined", found=type(other).__name__, hint="give the tables of one run, or their folder")
    files = [path for name in cast("list[File]", named) for path in files_of(name)]
    if len(files) == 1 and not files[0].is_dir():
        raise UsageError("one table is nothing to join", found=f"`{files[0]}`", hint="name the other tables of its run too")
    return files


def runs_of(logs: Logs, reading: Reading | None = None) -> Several[Run]:
    """Return the runs of logs, each with a name of its own; raises as `load` does."""
    return Several(runs_apart(list(_read(logs, reading or Reading()))))


def runs_mapped(
    logs: Logs,
    mapping: ChannelMap | File | None,
    start: float | None = None,
    end: float | None = None,
    *,
    models: Iterable[object] = (),
) -> Several[Run]:
    """Return the runs of logs as every command but `import` reads them, from start to end s; raises as `load` does.

    Without a mapping a log whose own names are not enough is read as the logs of the files of models were.
    """
    behind = mapping_of(Path(model) for model in models if isinstance(model, (str, PathLike)))
    part = part_between(start, end)
    chosen, otherwise = loaded_mapping(mapping), loaded_mapping(behind)
    return runs_of(logs, Reading(Importer(chosen, part=part, whole=True, recognise=True, otherwise=otherwise)))


def files_of(name: File, what: str = "log") -> list[Path]:
    """Return the files that a path or a pattern names, sorted by name; raises LogError where a pattern matches none."""
    path = Path(name).expanduser()
    if path.exists() or not has_magic(str(path)):
        return [path]
    found = sorted(map(Path, glob(str(path), recursive=True)))  # noqa: PTH207 - pathlib's takes hidden files
    if not found:
        raise LogError(f"no {what} matches `{name}`", found=neighbours(_plain(path)), hint="check the folder and the pattern")
    return found


def _read(logs: Logs, reading: Reading) -> Iterator[Run]:
    if isinstance(logs, Run):
        yield reading.of_run(logs)
    elif isinstance(logs, (str, PathLike)):
        yield from (run for path in files_of(logs) for run in reading.of_file(path))
    elif is_table(logs):
        yield reading.of_table(logs, "")
    elif isinstance(logs, Mapping):
        yield from (reading.of_table(table, name) for name, table in _tables(logs))
    elif isinstance(logs, Iterable):
        for log in cast("Iterable[Log]", logs):
            yield from _read(log, reading)
    else:
        raise _no_log(logs)


def is_table(item: object) -> TypeGuard[DataFrame]:
    """Whether an object is a pandas table; pandas is not imported: the owner of a table has loaded it."""
    return "pandas" in sys.modules and isinstance(item, sys.modules["pandas"].DataFrame)


def _tables(logs: Mapping[Any, Any]) -> Iterator[tuple[str, DataFrame]]:
    for name, item in logs.items():
        if not is_table(item):
            raise _no_log(item)
        yield str(name), item


def _no_log(item: Any) -> UsageError:
    return UsageError(
        "that is no log", found=type(item).__name__, hint="give a file, a pattern as `runs/*.parquet`, a pandas table or a run"
    )


def loaded_mapping(mapping: ChannelMap | File | None) -> ChannelMap | None:
    """Return a mapping, that of a file, or None for none; raises MappingError."""
    from fieldsid.logs.mapping.mapping_file import load_mapping

    return mapping if mapping is None or isinstance(mapping, ChannelMap) else load_mapping(Path(mapping))


def _plain(pattern: Path) -> Path:
    """Return a pattern up to its first part with a wildcard; the parts before that are a folder."""
    parts = pattern.parts
    first = next(i for i, part in enumerate(parts) if has_magic(part))
    return Path(*parts[: first + 1])
