"""`sysid import` as functions: choose the output file of each run, read the run, and write it with its notes."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np

from fieldsid.artifacts import check_output
from fieldsid.errors import UsageError
from fieldsid.logs.channels import ChannelMap, Source
from fieldsid.logs.convert.assemble import WHOLE
from fieldsid.logs.convert.conditioning import MAX_GAP_S, long_gaps
from fieldsid.logs.load import load_run
from fieldsid.logs.reader import rate_of
from fieldsid.logs.run import EXPLAINING, Note, Run
from fieldsid.logs.save import SUFFIXES, save_run
from fieldsid.logs.several.run_names import name_of_run, names_apart, stem_of
from fieldsid.logs.several.stretches import stretches_of
from fieldsid.records.keys import Key
from fieldsid.registry import near

FORMATS = {"parquet": ".parquet", "csv": ".csv", "csv.gz": ".csv.gz"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """A run that was written, and its file."""

    run: Run
    name: Annotated[str, Key("Its name.", "run")]
    file: Annotated[str, Key("The file that was written.")]
    log: Annotated[str | None, Key("The log it came from.")]
    samples: Annotated[int, Key("Number of samples.")]
    start_s: Annotated[float, Key("Time of the first sample.")]
    end_s: Annotated[float, Key("Time of the last sample.")]
    duration_s: Annotated[float, Key("Length.")]
    rate_hz: Annotated[float, Key("Samples per second, by the median step.")]
    signals: Annotated[Mapping[str, int], Key("Number of measured samples of each signal.")]
    notes: Annotated[tuple[Note, ...], Key("What was done and what was found.")]

    @property
    def warnings(self) -> tuple[Note, ...]:
        """The notes that the user should act on."""
        return tuple(n for n in self.notes if n.code not in EXPLAINING)


def runs_under_way(load: Callable[[tuple[float, float], float], Run], max_gap_s: float) -> list[Run]:
    """Return the stretches of a log in which the vehicle is under way, as runs.

    `load` reads the part of the log between two times in s, with the longest gap allowed in s.
    """
    run = load(WHOLE, np.inf)
    stretches, notes = stretches_of(run)
    if not notes:
        return [load(WHOLE, max_gap_s) if long_gaps(run.time, run.signals, max_gap_s) else run]
    return [replace(r, notes=(*r.notes, *notes)) for r in (load(part, max_gap_s) for part in stretches)]


@dataclass(frozen=True, slots=True)
class Importer:
    """The options of one import, the same for all its logs; `joined` are the other tables where a run consists of several tables.

    `otherwise` is the mapping for a log without one; see `load_run`.
    """

    mapping: ChannelMap | None = None
    channels: tuple[str, ...] = ()
    msg_path: Path | None = None
    part: tuple[float, float] = WHOLE
    max_gap_s: float = MAX_GAP_S
    salvage: bool = False
    whole: bool = False
    joined: tuple[Path, ...] = ()
    recognise: bool = False
    otherwise: ChannelMap | None = None

    def targets(self, logs: Sequence[Path], output: Path, form: str, *, force: bool = False) -> list[Path]:
        """Return the output file of each log; raise, before any log is read, the errors that concern all logs.

        Raises UsageError and ArtifactError for a file that cannot be written, MappingError for a channel that is not valid.
        """
        self._sources()
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
            names = [name_of_run([*logs, *self.joined])] if self.joined else names_apart([stem_of(log) for log in logs], logs)
            found = [output / f"{name}{FORMATS[form]}" for name in names]
        _check_free(logs, found, force=force)
        return found

    def read(
        self, log: Path, fin_max_rad: Mapping[str, float] | None = None, progress: Callable[[float], None] | None = None
    ) -> list[Run]:
        """Return the runs of one log: its stretches under way, each examined separately, or what `part` or `whole` select."""
        load = partial(
            load_run,
            log,
            self.mapping,
            channels=self._sources(),
            fin_max_rad=fin_max_rad,
            progress=progress,
            msg_path=self.msg_path,
            joined=self.joined,
            salvage=self.salvage,
            recognise=self.recognise,
            otherwise=self.otherwise,
        )
        if self.whole or self.part != WHOLE:
            return [load(part=self.part, max_gap_s=self.max_gap_s)]
        return runs_under_way(lambda part, gap: load(part=part, max_gap_s=gap), self.max_gap_s)

    def places(self, target: Path, count: int) -> list[Path]:
        """Return the output file of each of `count` runs of a log: the target, with a number appended where there are several."""
        suffix = next(s for s in SUFFIXES if target.name.endswith(s))
        stem = target.name.removesuffix(suffix)
        return [target] if count == 1 else [target.with_name(f"{stem}_{i + 1}{suffix}") for i in range(count)]

    def write(self, run: Run, path: Path, *, force: bool = False) -> Imported:
        """Write a run under the name of its file and return what was written."""
        named = replace(run, name=stem_of(path))
        start, end = float(run.time[0]), float(run.time[-1])
        return Imported(
            run=named,
            name=named.name,
            file=str(save_run(named, path, force=force)),
            log=None if run.source is None else str(run.source),
            samples=len(run),
            start_s=start,
            end_s=end,
            duration_s=end - start,
            rate_hz=rate_of(run.time),
            signals={s: int(np.isfinite(v).sum()) for s, v in run.signals.items()},
            notes=run.notes,
        )

    def _sources(self) -> dict[str, Source]:
        if not self.channels:
            return {}
        from fieldsid.logs.mapping.mapping_file import channel_of

        return dict(channel_of(text) for text in self.channels)


def _check_free(logs: Sequence[Path], targets: Sequence[Path], *, force: bool) -> None:
    places = [os.path.realpath(log) for log in logs]
    twice = next((log for log, place in zip(logs, places, strict=True) if places.count(place) > 1), None)
    if twice is not None:
        raise UsageError(f"`{twice}` is given twice", found=f"{len(logs)} logs", hint="give each log once")
    for log, target in zip(logs, targets, strict=True):
        if os.path.exists(target) and os.path.exists(log) and target.samefile(log):  # noqa: PTH110 - closed folders do not raise
            raise UsageError(f"`{log}` would be written over itself", found=str(target), hint="name another folder with `-o`")
        check_output(target, force=force)
