"""A command line shortened by the words that the trial folder adds to it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from fieldsid.cli.trial.filled import FILLS, runs_of_other_plane, words_from_folder
from fieldsid.cli.trial.parsed import parse
from fieldsid.trial_folder.journal import is_trial
from fieldsid.trial_folder.make import MAPPING
from fieldsid.trial_folder.state import FolderState, state_of

READ = ("--mapping", "--validate", "--measured", "--plan", "--vehicle")
"""Options whose file a trial folder may supply, as it may supply that of `-o`."""
DEFAULT = ("--mapping", MAPPING)
"""The option that every command that reads logs uses in a trial folder, without its being added to the line."""


def shortened_in_trial(words: Sequence[str]) -> list[str]:
    """Return a command line, without `sysid`, less the files that the trial folder would add; unchanged in any other folder.

    The short line is completed to the same words, in any order, except for runs that excite the other plane only.
    """
    words = list(words)
    if not is_trial(Path()):
        return words
    parsed = parse(words)
    if parsed is None or parsed.name not in FILLS:
        return words
    name, state = len(parsed.name.split()), cache(lambda: state_of(Path()))
    shorter = ([*words[:name], *_without_files(words[name:], options)] for options in ((*READ, "-o"), READ))
    return next((short for short in shorter if short != words and _completes_to(short, words, state)), words)


def _completes_to(short: Sequence[str], words: Sequence[str], state: Callable[[], FolderState]) -> bool:
    """Whether the trial folder completes a short command line to the given words."""
    parsed = parse(short)
    if parsed is None:
        return False
    others = set(runs_of_other_plane(parsed, state()))
    needed = [w for w in words if w not in others] if others <= set(words) else words
    return _completed(short, state) == _completed(needed, state)


def _without_files(words: Sequence[str], options: Sequence[str]) -> list[str]:
    """Return words without files and without the given options and their values; other options keep their files."""
    remaining, before = list[str](), ""
    for word in words:
        is_value = before.startswith("-")
        is_file = not is_value and not word.startswith("-") and Path(word).exists()
        if before not in options and word not in options and not is_file:
            remaining.append(word)
        before = "" if is_value else word
    return remaining


def _completed(words: Sequence[str], state: Callable[[], FolderState]) -> Counter[str]:
    """Return the words of a command line and those that the folder adds, each with its count."""
    parsed = parse(words)
    added = [] if parsed is None else words_from_folder(parsed, state)
    default = Counter(DEFAULT) if set(DEFAULT) <= set(words) else Counter[str]()
    return Counter(w.rstrip("/") for w in (*words, *added)) - default
