"""A command run in a trial folder: missing arguments are taken from the folder, and a line is added to its journal."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

import typer

from fieldsid.cli.console import say, take_verdict
from fieldsid.cli.exit_codes import BAD_INPUT, DONE, OUR_BUG
from fieldsid.cli.trial.filled import in_words, runs_of_other_plane, words_from_folder
from fieldsid.cli.trial.parsed import Parsed, parse
from fieldsid.errors import FieldsidError
from fieldsid.records.named_inputs import is_there
from fieldsid.trial_folder.journal import JOURNAL, Entry, Hashes, Stamp, append, read
from fieldsid.trial_folder.state import state_of

UNRECORDED = ("guide", "status", "demo", "effects list", "effects show", "init")
"""Commands without a line in the journal: they make no file of a trial. `init` writes its line itself, in the folder it makes."""
WRITTEN = ("output", "figure", "write_mapping")
"""Parameters that name output files."""
LONGEST_VERDICT = 300


def run_in_trial(arguments: Sequence[str], run: Callable[[Sequence[str]], Any]) -> Any:
    """Run a command in the working folder, which is a trial's, and add a line to its journal; raises as the command does."""
    parsed = parse(arguments)
    if parsed is None or parsed.name in UNRECORDED:
        return run(arguments)
    folder, state = Path(), cache(lambda: state_of(Path()))
    added = words_from_folder(parsed, state)
    if added:
        others = len(runs_of_other_plane(parsed, state()))
        more = f"; {others} more excite the other plane alone" if others else ""
        say(f"taken from the trial folder: {in_words(added)}{more}")
    words = [*arguments, *added]
    complete = parse(words) or parsed
    recorder = _Recorder(folder, words, complete)
    take_verdict()  # clear that of an earlier command
    try:
        result = run(words)
    except (typer.TyperException, typer.Abort):  # the command has not started
        raise
    except BrokenPipeError:  # the reader of the output has gone away, as `head` does: the work is done
        recorder.write(DONE, take_verdict())
        raise
    except FieldsidError as error:
        recorder.write(BAD_INPUT, error.what)
        raise
    except Exception as error:
        recorder.write(OUR_BUG, f"{type(error).__name__}: {error}")
        raise
    recorder.write(result if isinstance(result, int) else DONE, take_verdict())
    return result


class _Recorder:
    """Makes the journal's line of a command: it stores the files and the time at the start, and compares at the end."""

    def __init__(self, folder: Path, words: Sequence[str], parsed: Parsed) -> None:
        self._folder, self._words = folder, tuple(words)
        self._began, self._time = perf_counter(), datetime.now(UTC).isoformat(timespec="seconds")
        entries, _ = read(folder)
        self._hashes = Hashes(folder, entries)
        named = parsed.paths(*(n for n in parsed.values if n not in WRITTEN))
        read_from = [*named, *([Path("vehicle.yaml")] if "vehicle" in parsed.values else [])]
        self._inputs = self._stamps(dict.fromkeys(p for p in read_from if is_there(p)))
        self._before = _snapshot(folder)

    def write(self, code: int, verdict: str) -> None:
        """Add the line: exit code, verdict, and the files that were made or changed since the start."""
        after = _snapshot(self._folder)
        outputs = self._stamps(Path(p) for p, seen in after.items() if self._before.get(p) != seen)
        entry = Entry(
            self._time, ("sysid", *self._words), code, round(perf_counter() - self._began, 3),
            verdict[:LONGEST_VERDICT], self._inputs, outputs,
        )  # fmt: skip
        try:
            append(self._folder, entry)
        except OSError as error:  # the command has done its work: its result is valid without a line
            say(f"warning: `{JOURNAL}` cannot be written: {error.strerror} [journal]")

    def _stamps(self, paths: Any) -> tuple[Stamp, ...]:
        return tuple(self._hashes.stamp(p) for p in paths)


def _snapshot(folder: Path) -> dict[str, tuple[int, int]]:
    """Return size and modification time (ns) of every regular file below a folder, without hidden ones, links and the journal."""
    found = {}
    for place, folders, files in os.walk(folder):
        folders[:] = [f for f in folders if not f.startswith(".")]
        for name in files:
            if not name.startswith(".") and name != JOURNAL:
                path = Path(place) / name
                state = path.lstat()
                if stat.S_ISREG(state.st_mode):
                    found[path.as_posix()] = (state.st_size, state.st_mtime_ns)
    return found
