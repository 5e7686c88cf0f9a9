"""The running command line, and command lines ready to paste: quoted, several files of one folder as a pattern."""

from __future__ import annotations

from collections.abc import Sequence
from contextvars import ContextVar
from pathlib import Path

from fieldsid.cli.inputs import mapping_behind
from fieldsid.cli.trial.parsed import parse
from fieldsid.cli.trial.shortened import shortened_in_trial
from fieldsid.trial_folder.patterns import repeated, shortened

_WORDS: ContextVar[tuple[str, ...]] = ContextVar("words", default=())


def remember(words: Sequence[str]) -> None:
    """Store the words of the command that is about to run, without `sysid`."""
    _WORDS.set(tuple(words))


def typed_with(*more: str) -> str:
    """Return the running command line with more words added, without `--json`."""
    return pasted(*(w for w in _WORDS.get() if w != "--json"), *more)


def pasted(*words: str | Path | Sequence[str | Path]) -> str:
    """Return a command line of `sysid`; several files of one folder become the pattern that matches exactly them.

    In a trial folder the words that the folder supplies are left out.
    """
    flat = [_near(w) for word in words for w in ([word] if isinstance(word, (str, Path)) else word)]
    flat += _reading(flat)
    return shortened(["sysid", *shortened_in_trial(flat)], Path())


def _reading(words: Sequence[str]) -> list[str]:
    """Return the `--mapping` of the running command, for a command line that reads the same files.

    Where none was typed it is that of a typed model, if the logs need one and the line does not name that model.
    """
    typed, taken = parse(_WORDS.get()), set(map(Path, words))
    if typed is None:
        return []
    records = {p for p in typed.paths() if p.suffix in (".yaml", ".yml")}
    read = (set(typed.paths()) - records) & taken
    next_ = parse(words) if read else None
    if next_ is None or next_.values.get("mapping", "") is not None:
        return []
    mapping = typed.values.get("mapping")
    if mapping is None and not records & taken:
        mapping = mapping_behind(sorted(records), read)
    return [] if mapping is None else repeated("--mapping", [mapping])


def _near(word: str | Path) -> str:
    """Return a path relative to the working folder where it is below it, else unchanged."""
    here = Path.cwd()
    return str(word.relative_to(here)) if isinstance(word, Path) and word.is_relative_to(here) else str(word)
