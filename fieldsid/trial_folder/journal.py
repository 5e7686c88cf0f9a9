"""journal.jsonl: one line of JSON for each command that was run in a trial folder, with the hashes of what went in and came out.

The file marks a folder as a trial. A line is added whole; of a line that a power cut left unfinished nothing is believed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fieldsid._version import __version__
from fieldsid.display import Brief
from fieldsid.named_inputs import sha256_of

JOURNAL = "journal.jsonl"
SCHEMA = "fieldsid/journal/1"
GROUPS = (("schedule",), ("effects",))
"""First words of commands whose second word says which of several they are."""


@dataclass(frozen=True, slots=True, repr=False)
class Stamp(Brief):
    """A file as it was: its path, from the trial folder where it lies inside, its SHA-256, bytes, and time of writing in ns."""

    path: str
    sha256: str
    size: int
    modified_ns: int


@dataclass(frozen=True, slots=True, repr=False)
class Entry(Brief):
    """One command: when (ISO 8601, UTC), its words, exit code, seconds, the line it gave as its result, files in and out.

    `named` are the effects that a diagnosis named.
    """

    time: str
    command: tuple[str, ...]
    exit: int
    seconds: float
    verdict: str
    inputs: tuple[Stamp, ...] = ()
    outputs: tuple[Stamp, ...] = ()
    named: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The command without what it was given: `schedule verify`, `report`."""
        return " ".join(self.command[1 : 3 if self.command[1:2] in GROUPS else 2])


def is_trial(folder: Path) -> bool:
    """Whether a folder is that of a trial: it holds a journal."""
    return (folder / JOURNAL).is_file()


def append(folder: Path, entry: Entry) -> None:
    """Add one line to the journal of a folder, which makes it that of a trial."""
    body = {"schema": SCHEMA, "tool": f"fieldsid {__version__}", **asdict(entry)}
    path = folder / JOURNAL
    with path.open("ab+") as stream:
        cut = stream.seek(0, os.SEEK_END) > 0 and _last_byte(path) != b"\n"
        stream.write((b"\n" if cut else b"") + json.dumps(body, ensure_ascii=False).encode() + b"\n")
        stream.flush()
        os.fsync(stream.fileno())


def read(folder: Path) -> tuple[tuple[Entry, ...], int]:
    """Return the entries of a folder's journal, the oldest first, and how many of its lines are none."""
    path = folder / JOURNAL
    if not path.is_file():
        return (), 0
    found: list[Entry] = []
    broken = 0
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            found.append(_entry(json.loads(line)))
        except (ValueError, KeyError, TypeError):
            broken += bool(line.strip())
    return tuple(found), broken


class Hashes:
    """SHA-256 of files, those known to a journal by path, size and time of writing not computed again."""

    def __init__(self, folder: Path, entries: Iterable[Entry]) -> None:
        self._folder = folder.resolve()
        stamps = (s for e in entries for s in (*e.inputs, *e.outputs))
        self._known = {(s.path, s.size, s.modified_ns): s.sha256 for s in stamps}

    def stamp(self, path: Path) -> Stamp:
        """Return a file or folder as it is now."""
        name, is_folder, state = relative_to(path, self._folder), path.is_dir(), path.stat()
        size = 0 if is_folder else state.st_size
        known = None if is_folder else self._known.get((name, size, state.st_mtime_ns))
        return Stamp(name, known or sha256_of(path), size, state.st_mtime_ns)


def relative_to(path: Path, folder: Path) -> str:
    """Return a path from a folder where it lies inside, else in full, with forward slashes."""
    whole = path.resolve()
    inside = whole.is_relative_to(folder.resolve())
    return (whole.relative_to(folder.resolve()) if inside else whole).as_posix()


def made_by(entries: Sequence[Entry], path: str) -> Entry | None:
    """Return the last command that wrote a file, None where the journal knows none."""
    return next((e for e in reversed(entries) if any(s.path == path for s in e.outputs)), None)


def _entry(body: Mapping[str, Any]) -> Entry:
    if not str(body["schema"]).startswith("fieldsid/journal/"):
        raise ValueError(body["schema"])
    ins, outs = (tuple(Stamp(**s) for s in body[k]) for k in ("inputs", "outputs"))
    words, named = (tuple(str(w) for w in body[k]) for k in ("command", "named"))
    return Entry(
        str(body["time"]), words, int(body["exit"]), float(body["seconds"]), str(body["verdict"]), ins, outs, named
    )  # fmt: skip


def _last_byte(path: Path) -> bytes:
    with path.open("rb") as stream:
        stream.seek(-1, os.SEEK_END)
        return stream.read(1)
