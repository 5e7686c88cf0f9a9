"""A command line without what its trial folder fills it in with."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from fieldsid.cli.trial.filled import FILLS, filled, left_out
from fieldsid.cli.trial.parsed import parse
from fieldsid.trial_folder.journal import is_trial
from fieldsid.trial_folder.make import MAPPING
from fieldsid.trial_folder.state import FolderState, state_of

READ = ("--mapping", "--validate", "--measured", "--plan", "--vehicle")
"""Options whose file a trial folder may give, as it may give that of `-o`."""
DEFAULT = ("--mapping", MAPPING)
"""What every reading takes in a trial folder, without its being filled in."""


def without_the_filled(words: Sequence[str]) -> list[str]:
    """Return a command line, `sysid` left out, without the files that it takes from the working folder; elsewhere as it is.

    What is left is filled in to the same words, in whatever order, but for runs that excite the other plane alone.
    """
    words = list(words)
    if not is_trial(Path()):
        return words
    parsed = parse(words)
    if parsed is None or parsed.name not in FILLS:
        return words
    name, state = len(parsed.name.split()), cache(lambda: state_of(Path()))
    shorter = ([*words[:name], *_without_files(words[name:], options)] for options in ((*READ, "-o"), READ))
    return next((bare for bare in shorter if bare != words and _is_filled_to(bare, words, state)), words)


def _is_filled_to(bare: Sequence[str], words: Sequence[str], state: Callable[[], FolderState]) -> bool:
    parsed = parse(bare)
    if parsed is None:
        return False
    others = set(left_out(parsed, state()))
    needed = [w for w in words if w not in others] if others <= set(words) else words
    return _whole(bare, state) == _whole(needed, state)


def _without_files(words: Sequence[str], options: Sequence[str]) -> list[str]:
    """Return words without files, and without options that name one; the file of another option stays with it."""
    kept, before = list[str](), ""
    for word in words:
        is_value = before.startswith("-")
        is_file = not is_value and not word.startswith("-") and Path(word).exists()
        if before not in options and word not in options and not is_file:
            kept.append(word)
        before = "" if is_value else word
    return kept


def _whole(words: Sequence[str], state: Callable[[], FolderState]) -> Counter[str]:
    """Return the words of a command line and those that the folder fills in, each as often as it is there."""
    parsed = parse(words)
    added = [] if parsed is None else filled(parsed, state)
    default = Counter(DEFAULT) if set(DEFAULT) <= set(words) else Counter[str]()
    return Counter(w.rstrip("/") for w in (*words, *added)) - default
