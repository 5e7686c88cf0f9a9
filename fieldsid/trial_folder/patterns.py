"""Short command lines: many files are replaced by a pattern that matches exactly them, where there is one."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from glob import escape
from itertools import groupby
from os.path import commonprefix, isfile
from pathlib import Path

FEW = 3
"""Number of files up to which each is named; more are replaced by a pattern that matches exactly them, where there is one."""


def pattern_of(files: Sequence[Path], folder: Path = Path()) -> list[str]:
    """Return the words for files relative to a folder, quoted for a shell: a pattern that matches exactly them, else each."""
    parents, suffixes = {p.parent for p in files}, {p.suffix for p in files}
    if len(files) > FEW and len(parents) == len(suffixes) == 1:
        parent, suffix = parents.pop(), suffixes.pop()
        start = commonprefix([p.stem for p in files])  # noqa: RUF071 - characters are what is meant
        if suffix and sorted((folder / parent).glob(f"{escape(start)}*{suffix}")) == sorted(folder / p for p in files):
            before = "" if parent == Path() else f"{shlex.quote(str(parent))}/"
            return [f"{before}{shlex.quote(start) if start else ''}*{suffix}"]
    return [shlex.quote(str(p)) for p in files]


def shortened(words: Sequence[str], folder: Path) -> str:
    """Return a command line that was run in a folder, quoted, its many files as patterns."""

    def kind(word: str) -> tuple[Path, str] | None:
        path = Path(word)
        return None if word.startswith("-") or not isfile(folder / path) else (path.parent, path.suffix)  # noqa: PTH113 - says no

    groups = [(of_one, list(group)) for of_one, group in groupby(words, key=kind)]
    parts = [[shlex.quote(w) for w in g] if of_one is None else pattern_of([Path(w) for w in g], folder) for of_one, g in groups]
    return " ".join(word for part in parts for word in part)


def repeated(option: str, values: Iterable[str | Path]) -> list[str]:
    """Return an option of one value, repeated for each value."""
    return [word for value in values for word in (option, str(value))]
