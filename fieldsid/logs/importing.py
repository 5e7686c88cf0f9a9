"""`sysid import` as functions: where each run goes, reading it, and writing it with its notes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.artifacts import plain
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.logs.channels import Source
from fieldsid.logs.load import load_run
from fieldsid.logs.run import Note, Run
from fieldsid.logs.save import SUFFIXES, save_run
from fieldsid.registry import near

FORMATS = {"parquet": ".parquet", "csv": ".csv", "csv.gz": ".csv.gz"}
QUIET = frozenset({"time_origin", "clock", "mapping", "ignored_columns"})
"""Notes that explain rather than warn."""


@dataclass(frozen=True, slots=True)
class Imported:
    """A run that was written, and where."""

    run: Run
    path: Path

    @property
    def warnings(self) -> tuple[Note, ...]:
        """The notes that the user should act on."""
        return tuple(n for n in self.run.notes if n.code not in QUIET)

    def record(self) -> dict[str, Any]:
        """Return what was written as plain values."""
        run = self.run
        return {
            "run": run.name,
            "file": str(self.path),
            "log": None if run.source is None else str(run.source),
            "samples": len(run),
            "start_s": float(run.time[0]),
            "end_s": float(run.time[-1]),
            "duration_s": float(run.time[-1] - run.time[0]),
            "rate_hz": 1.0 / float(np.median(np.diff(run.time))),
            "signals": {s: int(np.isfinite(v).sum()) for s, v in run.signals.items()},
            "notes": [{"code": n.code, "message": n.message, "data": plain(n.data)} for n in run.notes],
        }


@dataclass(frozen=True, slots=True)
class Importer:
    """The choices of one import, the same for all its logs."""

    mapping: Path | None = None
    channels: tuple[str, ...] = ()
    msg_path: Path | None = None
    from_s: float | None = None
    to_s: float | None = None
    max_gap_s: float = 2.0
    salvage: bool = False

    def targets(self, logs: Sequence[Path], output: Path, form: str, *, force: bool = False) -> list[Path]:
        """Return the file each log becomes; raises before anything is read when one cannot be written or two are the same."""
        if form not in FORMATS:
            raise UsageError(f"`--format {form}` is not a format", found=form, hint=near(form, list(FORMATS)))
        if output.name.endswith(SUFFIXES) and not output.is_dir():
            if len(logs) > 1:
                raise UsageError(
                    f"{len(logs)} logs do not go into one file",
                    found=str(output),
                    hint=f"name a folder: `-o {output.parent / 'runs'}`",
                )
            found = [output]
        else:
            found = [output / f"{_stem(log)}{FORMATS[form]}" for log in logs]
        _check_free(logs, found, output, force=force)
        return found

    def read(self, log: Path, fin_max_rad: Mapping[str, float] | None = None) -> Run:
        """Read one log and cut it to the times asked for."""
        run = load_run(
            log,
            self.mapping,
            channels=self._sources(),
            msg_path=self.msg_path,
            salvage=self.salvage,
            max_gap_s=self._gap_limit(),
            fin_max_rad=fin_max_rad,
        )
        if self.from_s is None and self.to_s is None:
            return run
        low = float(run.time[0]) if self.from_s is None else self.from_s
        high = float(run.time[-1]) if self.to_s is None else self.to_s
        return run.between(low, high)

    def write(self, run: Run, path: Path, *, force: bool = False) -> Imported:
        """Write a run and return what was written."""
        return Imported(run, save_run(run, path, force=force))

    def _gap_limit(self) -> float:
        return self.max_gap_s

    def _sources(self) -> dict[str, Source]:
        if not self.channels:
            return {}
        from fieldsid.logs.mapping import channel_of

        return dict(channel_of(text) for text in self.channels)


def _stem(log: Path) -> str:
    """Return a log's name without its suffixes: `run7.csv.gz` and the folder `run7` become run7."""
    name = log.name or log.resolve().name
    for suffix in (".gz", ".zstd"):
        name = name.removesuffix(suffix)
    stem, dot, suffix = name.rpartition(".")
    known = {"csv", "txt", "tsv", "dat", "parquet", "bag", "mcap", "db3"}
    return "stdin" if name == "-" else stem if dot and suffix.lower() in known else name


def _check_free(logs: Sequence[Path], targets: Sequence[Path], output: Path, *, force: bool) -> None:
    twice = sorted({str(t) for t in targets if targets.count(t) > 1})
    if twice:
        raise UsageError("two logs would become the same run", found=twice[0], hint="import them into different folders")
    if output.exists() and not output.is_dir() and not output.name.endswith(SUFFIXES):
        raise UsageError(
            f"`{output}` is a file, not a folder", found=f"{output.stat().st_size} bytes", hint="name a folder, or `run.parquet`"
        )
    for log, target in zip(logs, targets, strict=True):
        if target.exists() and log.exists() and target.samefile(log):
            raise UsageError(f"`{log}` would be written over itself", found=str(target), hint="name another folder with `-o`")
        if target.exists() and not force:
            raise ArtifactError(
                f"`{target}` exists", found=f"{target.stat().st_size} bytes", hint="add `--force`, or name another output"
            )
