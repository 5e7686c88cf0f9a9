"""A command run in a trial folder: what it leaves out is taken from there, and what it did becomes a line of the journal."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

import typer

from fieldsid.cli.console import said, say
from fieldsid.cli.exit_codes import BAD_INPUT, DONE, OUR_BUG
from fieldsid.cli.trial.filled import filled, in_words, left_out
from fieldsid.cli.trial.parsed import Parsed, parse
from fieldsid.errors import FieldsidError
from fieldsid.records.named_inputs import is_there
from fieldsid.trial_folder.journal import JOURNAL, Entry, Hashes, Stamp, append, read
from fieldsid.trial_folder.state import state_of

NOT_KEPT = ("guide", "status", "demo", "effects list", "effects show", "init")
"""Commands that make nothing of a trial: they leave no line. `init` writes its own, into the folder it makes."""
WRITTEN = ("output", "figure", "write_mapping")
"""Parameters that name what is written, not what is read."""
LONGEST_VERDICT = 300


def run_in_trial(arguments: Sequence[str], run: Callable[[Sequence[str]], Any]) -> Any:
    """Run a command in the working folder, which is a trial's, and add a line to its journal; raises as the command does."""
    parsed = parse(arguments)
    if parsed is None or parsed.name in NOT_KEPT:
        return run(arguments)
    folder, state = Path(), cache(lambda: state_of(Path()))
    added = filled(parsed, state)
    if added:
        others = len(left_out(parsed, state()))
        more = f"; {others} more excite the other plane alone" if others else ""
        say(f"taken from the trial folder: {in_words(added)}{more}")
    words = [*arguments, *added]
    whole = parse(words) or parsed
    kept = _Kept(folder, words, whole)
    said()  # of whatever ran before
    try:
        result = run(words)
    except (typer.TyperException, typer.Abort):  # nothing was begun
        raise
    except BrokenPipeError:  # who read the output went away, as `head` does: the work is done
        kept.write(DONE, said())
        raise
    except FieldsidError as error:
        kept.write(BAD_INPUT, error.what)
        raise
    except Exception as error:
        kept.write(OUR_BUG, f"{type(error).__name__}: {error}")
        raise
    kept.write(result if isinstance(result, int) else DONE, said(), result)
    return result


class _Kept:
    """What the journal will hold of a command: what was there when it began."""

    def __init__(self, folder: Path, words: Sequence[str], parsed: Parsed) -> None:
        self._folder, self._words = folder, tuple(words)
        self._began, self._time = perf_counter(), datetime.now(UTC).isoformat(timespec="seconds")
        entries, _ = read(folder)
        self._hashes = Hashes(folder, entries)
        named = parsed.paths(*(n for n in parsed.values if n not in WRITTEN))
        read_from = [*named, *([Path("vehicle.yaml")] if "vehicle" in parsed.values else [])]
        self._inputs = self._stamps(dict.fromkeys(p for p in read_from if is_there(p)))
        self._before = _snapshot(folder)

    def write(self, code: int, verdict: str, result: Any = None) -> None:
        """Add the line: exit code, verdict, the files that are new or were changed meanwhile."""
        after = _snapshot(self._folder)
        outputs = self._stamps(Path(p) for p, seen in after.items() if self._before.get(p) != seen)
        body: Mapping[str, Any] = result if isinstance(result, Mapping) else {}
        named = body.get("effects") if self._words[0] == "diagnose" else None
        entry = Entry(
            self._time, ("sysid", *self._words), code, round(perf_counter() - self._began, 3),
            verdict[:LONGEST_VERDICT], self._inputs, outputs, tuple(named or ()),
        )  # fmt: skip
        try:
            append(self._folder, entry)
        except OSError as error:  # the command has done its work: that stands without a line
            say(f"warning: `{JOURNAL}` cannot be written: {error.strerror} [journal]")

    def _stamps(self, paths: Any) -> tuple[Stamp, ...]:
        return tuple(self._hashes.stamp(p) for p in paths)


def _snapshot(folder: Path) -> dict[str, tuple[int, int]]:
    """Return size and time of writing of every plain file below a folder, hidden ones, links and the journal left out."""
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
