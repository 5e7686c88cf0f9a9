"""journal.jsonl: one line of JSON for each command that was run in a trial folder, with the hashes of its inputs and outputs.

The file marks a folder as a trial. Lines are appended in one write; a line that a power cut left incomplete is ignored.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, BinaryIO

from fieldsid._version import __version__
from fieldsid.display import Brief
from fieldsid.errors import shortened
from fieldsid.records.check import Shape, ShapeError, check, number, text, whole_number
from fieldsid.records.keys import Key
from fieldsid.records.named_inputs import sha256_of, sha256_of_named
from fieldsid.records.reading import read_json

JOURNAL = "journal.jsonl"
SCHEMA = "fieldsid/journal/1"
GROUPS = (("schedule",), ("effects",))
"""First words of commands with subcommands."""
LARGEST = 32 << 20
"""Most bytes of a journal that are read, enough for 30,000 commands."""
STAMP = {"path": text, "sha256": text, "size": whole_number, "modified_ns": whole_number}
SHAPE: Shape = {
    "schema": text,
    "time": text,
    "command": [text],
    "exit": whole_number,
    "seconds": number(),
    "verdict": text,
    "inputs": [STAMP],
    "outputs": [STAMP],
}
"""The shape of a line of the journal."""
_OF_FOLDER = -1
"""Size of a folder in the journal, which never matches: the hash of a folder is always computed again, as its files may
change."""
_ODD = re.compile("[\ud800-\udfff]")
"""The surrogates that Python uses for bytes of a name that are not UTF-8; they are written as escapes."""


@dataclass(frozen=True, slots=True, repr=False)
class Stamp(Brief):
    """A file as it was: its path, from the trial folder where it lies inside, its SHA-256, bytes, and time of writing in ns."""

    path: str
    sha256: str
    size: int
    modified_ns: int


@dataclass(frozen=True, slots=True, repr=False)
class Entry(Brief):
    """One command: when (ISO 8601, UTC), its words, exit code, seconds, the line it gave as its result, files in and out."""

    time: Annotated[str, Key("When it was run, ISO 8601 in UTC.")]
    command: Annotated[tuple[str, ...], Key("Its words.")]
    exit: Annotated[int, Key("Its exit code.")]
    seconds: Annotated[float, Key("How long it took.")]
    verdict: Annotated[str, Key("The first line of what it said.")]
    inputs: tuple[Stamp, ...] = ()
    outputs: tuple[Stamp, ...] = ()

    @property
    def name(self) -> str:
        """The command without what it was given: `schedule verify`, `report`."""
        return " ".join(self.command[1 : 3 if self.command[1:2] in GROUPS else 2])

    @property
    def when(self) -> str:
        """When it was run, by the clock of this machine."""
        return datetime.fromisoformat(self.time).astimezone().strftime("%Y-%m-%d %H:%M")


def is_trial(folder: Path) -> bool:
    """Whether a folder is that of a trial: it has a journal, which is a file and not a symbolic link."""
    return (folder / JOURNAL).is_file() and not (folder / JOURNAL).is_symlink()


def append(folder: Path, entry: Entry) -> None:
    """Add one line to the journal of a folder, which makes it that of a trial; raises OSError where it is a link."""
    body = {"schema": SCHEMA, "tool": f"fieldsid {__version__}", **asdict(entry)}
    line = _ODD.sub(lambda found: f"\\\\u{ord(found[0]):04x}", json.dumps(body, ensure_ascii=False))
    with open(folder / JOURNAL, "ab+", opener=_no_link) as stream:
        cut = stream.seek(0, os.SEEK_END) > 0 and _last_byte(stream) != b"\n"
        stream.write((b"\n" if cut else b"") + line.encode() + b"\n")
        stream.flush()
        os.fsync(stream.fileno())


def read(folder: Path) -> tuple[tuple[Entry, ...], int]:
    """Return the entries of a folder's journal, the oldest first, and the number of invalid lines.

    Of a journal larger than LARGEST bytes the newest entries are read.
    """
    if not is_trial(folder):
        return (), 0
    found: list[Entry] = []
    broken = 0
    with open(folder / JOURNAL, "rb", opener=_no_link) as stream:
        stream.seek(max(0, stream.seek(0, os.SEEK_END) - LARGEST))
        for line in stream.read(LARGEST).split(b"\n"):
            try:
                found.append(_entry(read_json(line)))
            except (ValueError, OverflowError):
                broken += bool(line.strip())
    return tuple(found), broken


def _no_link(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0), 0o666)


class Hashes:
    """SHA-256 of files; taken from the journal where path, size and modification time are the same."""

    def __init__(self, folder: Path, entries: Iterable[Entry]) -> None:
        self._folder = folder.resolve()
        stamps = (s for e in entries for s in (*e.inputs, *e.outputs))
        self._known: dict[tuple[str, int, int], str | None] = {(s.path, s.size, s.modified_ns): s.sha256 for s in stamps}

    def stamp(self, path: Path) -> Stamp:
        """Return the stamp of a file or folder as it is now, whatever its size."""
        name, is_folder, state = relative_to(path, self._folder), path.is_dir(), path.stat()
        size = 0 if is_folder else state.st_size
        known = None if is_folder else self._known.get((name, size, state.st_mtime_ns))
        return Stamp(name, known or sha256_of(path), size, state.st_mtime_ns)

    def of_named(self, path: Path) -> str | None:
        """Return the SHA-256 of a named file, from the journal or within the limits of `sha256_of_named`; else None."""
        state = path.stat()
        size = _OF_FOLDER if path.is_dir() else state.st_size
        key = (relative_to(path, self._folder), size, state.st_mtime_ns)
        if key not in self._known:
            self._known[key] = sha256_of_named(path)
        return self._known[key]


def relative_to(path: Path, folder: Path) -> str:
    """Return a path relative to a folder where it lies inside, else in full, with forward slashes."""
    full = path.resolve()
    inside = full.is_relative_to(folder.resolve())
    return (full.relative_to(folder.resolve()) if inside else full).as_posix()


def made_by(entries: Sequence[Entry], path: str) -> Entry | None:
    """Return the last command that wrote a file, None where the journal has none."""
    return next((e for e in reversed(entries) if any(s.path == path for s in e.outputs)), None)


def _entry(body: Any) -> Entry:
    """Return the entry of a line; raises ValueError where it is invalid, OverflowError for an impossible time."""
    check(body, SHAPE)
    datetime.fromisoformat(body["time"]).astimezone()
    if not body["schema"].startswith("fieldsid/journal/") or len(body["command"]) < 2:
        raise ShapeError(f"`schema` is {shortened(body['schema'])}, or no command is named")
    ins, outs = (tuple(Stamp(**{f: s[f] for f in STAMP}) for s in body[k]) for k in ("inputs", "outputs"))
    return Entry(body["time"], tuple(body["command"]), body["exit"], float(body["seconds"]), body["verdict"], ins, outs)


def _last_byte(stream: BinaryIO) -> bytes:
    stream.seek(-1, os.SEEK_END)
    return stream.read(1)
