"""Reading the runs of a command: files of any known format, and `-` for CSV on standard input."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldsid.errors import FieldsidError, UsageError
from fieldsid.records import named_inputs
from fieldsid.runtime.pickling import dumps, loads
from fieldsid.runtime.worker_pool import fork_worker

if TYPE_CHECKING:
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.logs.channels import ChannelMap
    from fieldsid.logs.run import Run
    from fieldsid.logs.several.sifting import Refused
    from fieldsid.models.model import Model

STDIN = Path("-")
AXIS_OPTION = "`--axis {axis}`"
"""How an axis is stated on a command line, for hints."""
READING = ("pandas", "pyarrow")
"""Libraries whose import takes most of the time of reading the first log; once they are loaded, a worker saves no time."""


def read_runs(paths: Sequence[Path], **how: Any) -> list[Run]:
    """Return the runs of one group of files; options, errors and messages as those of `read_groups`."""
    (runs,) = read_groups([paths], **how)
    return runs


def read_groups(
    groups: Sequence[Sequence[Path]],
    *,
    mapping: Path | None = None,
    models: Iterable[Path] = (),
    start: float | None = None,
    end: float | None = None,
    check: Callable[[], None] = lambda: None,
    meanwhile: Callable[[], None] | None = None,
    refused: Refused[Path] | None = None,
) -> list[list[Run]]:
    """Return the runs of each group of files, each with a unique name, cut to `start` .. `end` s where given.

    Without a mapping, a log whose column names are not sufficient is read with the mapping of the logs of the `models`.
    check: validates all other arguments; its errors come before those of a file. meanwhile: runs in this process while a forked
    worker reads the files; without a fork, or once READING is loaded, the files are read here. refused: called with each file
    that cannot be read, and the error. Raises LogError, MappingError or DataError (the cut leaves nothing) without `refused`, and
    where no file of a group can be read; raises UsageError where two files have the same data.
    """
    from fieldsid.logs.several.run_names import refuse_twice
    from fieldsid.logs.several.sifting import attempt, sifted

    paths = [path for group in groups for path in group]
    if paths.count(STDIN) > 1:
        raise UsageError("standard input can be read once", found="`-` twice", hint="save the second log to a file")
    read = partial(
        _read, mapping=mapping_of(mapping), otherwise=mapping_of(named_inputs.mapping_of(models)), start=start, end=end
    )
    is_worth_forking = STDIN not in paths and not any(library in sys.modules for library in READING)
    known = _read_in_worker(read, paths, check, meanwhile) if meanwhile is not None and is_worth_forking else None
    if known is None:
        check()
    outcomes = iter(known or (attempt(read, path) for path in paths))
    kept = [sifted(group, islice(outcomes, len(group)), refused) for group in groups]
    used, runs = [path for group in kept for path, _ in group], [run for group in kept for _, run in group]
    refuse_twice(runs, used)
    say_how_read(runs, several=len(paths) > 1)
    named = iter(_apart(runs, used, paths))
    return [list(islice(named, len(group))) for group in kept]


def read_ready(
    groups: Sequence[Sequence[Path]], skips: Skips, module: str, models: Mapping[Path, Model | None], *,
    check: Callable[[], None] = lambda: None, **how: Any,
) -> list[list[Run]]:  # fmt: skip
    """Return the runs of each group of files; the command's module is imported, and its models are checked, while they are read.

    `skips` hears of files that cannot be read; options and errors as those of `read_groups`.
    """
    from fieldsid.cli.progress import get_ready
    from fieldsid.cli.user_effects import check_effects

    def check_all() -> None:
        check_effects((path, model) for path, model in models.items() if model is not None)
        check()

    return read_groups(groups, models=models, check=check_all, meanwhile=partial(get_ready, module), refused=skips.skip, **how)


def say_how_read(runs: Sequence[Run], *, several: bool, also: Sequence[str] = ()) -> None:
    """Print on stderr how logs without a mapping were read, each sentence once; `also` are the codes of other notes on that."""
    from fieldsid.cli.console import one_of_each_kind, say
    from fieldsid.logs.run import READ_AS, READ_WITH

    unmapped = [run for run in runs if all(note.code != READ_WITH for note in run.notes)]
    found = ((n.message, run.name if several else "", n) for run in unmapped for n in run.notes if n.code in (READ_AS, *also))
    for note in one_of_each_kind(found):
        say(note.message)


def _apart(runs: Sequence[Run], used: Sequence[Path], paths: Sequence[Path]) -> list[Run]:
    """Return the runs with unique names, which do not depend on which of the files can be read."""
    from fieldsid.logs.several.run_names import names_apart, stem_of

    own = dict(zip(paths, names_apart([stem_of(path) for path in paths], paths), strict=True))
    return [replace(run, name=own[path]) for run, path in zip(runs, used, strict=True)]


def read_run(path: Path, *, mapping: Path | None = None, models: Iterable[Path] = ()) -> Run:
    """Return the run of one file as `read_groups` does; raises LogError."""
    return _read(path, mapping_of(mapping), mapping_of(named_inputs.mapping_of(models)))


def mapping_of(path: Path | None) -> ChannelMap | None:
    """Return the mapping of a file; its errors are raised before any log is read."""
    if path is None:
        return None
    from fieldsid.logs.mapping.mapping_file import load_mapping

    return load_mapping(path)


def one_run(command: str, logs: Sequence[Path], *, join: bool) -> list[Path]:
    """Return the log and, with `join`, the other tables of its run; raises UsageError for several logs without `join`."""
    files = shlex.join(map(str, logs))
    if join and len(logs) == 1 and not logs[0].is_dir():
        raise UsageError("one table is nothing to join", found=f"`{logs[0]}`", hint="name the other tables of its run too")
    if join and STDIN in logs:
        raise UsageError("standard input is not joined with other tables", found="`-`", hint="save it to a file")
    if len(logs) > 1 and not join:
        hint = f"one at a time; or, where they are the tables of one run, `sysid {command} --join {files}`"
        raise UsageError(f"`{command}` takes one log", found=f"{len(logs)} logs", hint=hint)
    if join and any(log.is_dir() for log in logs[1:] if len(logs) > 1):
        raise UsageError("a folder is joined by itself", found=files, hint="name the tables in it")
    return list(logs)


def model_first(model: Path, runs: Sequence[Path]) -> tuple[Path, list[Path]]:
    """Return the model and the runs of a command line, in whichever order they were typed."""
    from fieldsid.logs.unknown_file import own_kind

    given = [model, *runs]
    at = next((i for i, path in enumerate(given) if own_kind(path) == "model"), 0)
    return given[at], [*given[:at], *given[at + 1 :]]


def models_among(paths: Sequence[Path]) -> list[Path]:
    """Return the models among several files, and name on stderr the program's other files; all files where none is a model."""
    from fieldsid.cli.console import say
    from fieldsid.logs.unknown_file import own_kind

    kinds = {path: own_kind(path) for path in paths} if len(paths) > 1 else {}
    if "model" not in kinds.values():
        return list(paths)
    others = [path for path in paths if kinds[path] not in ("model", None)]
    if others:
        say(f"passed over, no model: {', '.join(f'{path} ({kinds[path]})' for path in others)}")
    return [path for path in paths if path not in others]


def files_of(runs: Sequence[Run]) -> list[Path]:
    """Return the existing files that the runs were read from, for the hashes in an output; standard input has none."""
    return [run.source for run in runs if run.source is not None and run.source.exists()]


def mapping_behind(models: Iterable[Path], logs: Iterable[Path]) -> Path | None:
    """Return the mapping that the logs of models were read with, where each of some logs that can be read needs one."""
    from fieldsid.logs.load import needs_mapping
    from fieldsid.logs.several.sifting import attempt

    behind = named_inputs.mapping_of(models)
    return behind if behind is not None and all(attempt(needs_mapping, log) is not False for log in logs) else None


def _read(
    path: Path, mapping: ChannelMap | None, otherwise: ChannelMap | None, start: float | None = None, end: float | None = None
) -> Run:
    from fieldsid.logs import load_run
    from fieldsid.logs.convert.assemble import part_between

    return load_run(path, mapping, part=part_between(start, end), recognise=True, otherwise=otherwise)


def _read_in_worker(
    read: Callable[[Path], Run], paths: Sequence[Path], check: Callable[[], None], meanwhile: Callable[[], None]
) -> list[Run | FieldsidError] | None:
    """Return the runs or errors that a forked worker read; None without an answer: the caller then reads the files itself."""
    from fieldsid.logs.several.sifting import attempt

    worker = fork_worker(lambda: dumps([attempt(read, path) for path in paths]))
    if worker is None:
        return None
    with worker:
        check()
        meanwhile()
        answer = worker.answer()
    return None if answer is None else loads(answer)


def fitted_to(path: Path, model: Model, runs: Iterable[Run]) -> frozenset[str]:
    """Return the names of the runs that a model was fitted to, without those of a different log of the same name.

    Logs are compared by their hashes; where the model's log no longer exists, or has another format, by name only.
    """
    from fieldsid.logs.several.run_names import stem_of

    own = {(stem_of(p), p.suffix): p for p in named_inputs.inputs_of(path)}
    pairs = [(r.name, r.source, own.get((stem_of(r.source), r.source.suffix))) for r in runs if r.source is not None]
    return frozenset(model.runs) - frozenset(
        name
        for name, here, there in pairs
        if there is not None
        and here.is_file()
        and there.is_file()
        and named_inputs.sha256_of(here) != named_inputs.sha256_of_named(there)
    )
