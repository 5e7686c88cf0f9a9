"""The contract of a reader: one file in readers/ with a `READER`; it recognises, lists and reads one kind of log."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from fieldsid.display import Brief
from fieldsid.errors import FieldsidError, LogError
from fieldsid.logs.channels import ChannelMap, Source, TableForm
from fieldsid.logs.few_of import few_of
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import COPY_AGAIN, not_a_log
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Interval, Key, Number
from fieldsid.records.reading import near_files
from fieldsid.registry import members

PACKAGE = "fieldsid.logs.readers"
DEFINED = "message"
"""The kind of a topic whose fields the format defines: its names are not guessed at."""
MOST_CHANNELS = 5000
"""Channels of a log that are looked into, twice those of a glider, which has the most; of others, how many there are is said."""
TABLE = "table"
"""The kind of a topic that is a file of its own, whose fields are its columns."""
JOINED = "several_tables"
"""The reader of a run in several tables."""
WORTH_SALVAGING = 0.5
"""Share of a log from which its readable part is offered."""


@dataclass(frozen=True, slots=True)
class Series:
    """One signal as the log has it: stamps (n,) in s, and numbers (n,) or quaternions (n, 4) as x y z w.

    `unit` is what the file itself says about the numbers. `is_height` marks a z coordinate, up in ENU.
    """

    time: FloatArray
    values: FloatArray
    label: str
    unit: str | None = None
    is_height: bool = False


@dataclass(frozen=True, slots=True)
class RawLog:
    """What a reader hands on: series by canonical signal (or `attitude`), and what it noticed.

    `finished` marks a Run of ours that was written before: its signals are taken as they are.
    """

    name: str
    series: Mapping[str, Series]
    notes: tuple[Note, ...] = ()
    finished: bool = False
    one_clock: bool = True


@dataclass(frozen=True, slots=True)
class FieldInfo:
    """One number inside a channel: its path (empty for a column), its type, first values, least and largest.

    `means` is the signal that it is by the definition of the format itself, with what a mapping must say to read it.
    """

    path: Annotated[str, Key("Its path in a message; empty for the column of a table.")]
    kind: Annotated[str, Key("`number`, `text` or the message's own type.", "type")]
    first: Annotated[tuple[Any, ...], Key("Its first values.")]
    span: Annotated[
        tuple[float, float] | None, Key("Smallest and largest value; null where it is not a number.", of=Interval | None)
    ] = None
    means: tuple[str, Mapping[str, Any]] | None = None


def span_of(values: npt.NDArray[Any]) -> tuple[float, float] | None:
    """Return the least and the largest of numbers, those that are none left out; None where there are none."""
    if values.dtype.kind not in "fiub":
        return None
    seen = values[np.isfinite(values)]
    return (float(seen.min()), float(seen.max())) if seen.size else None


@dataclass(frozen=True, slots=True)
class Samples:
    """The numbers of a table's columns by name or place, (n,) each, on its time (n,) in s, which `source` reads."""

    time: FloatArray
    columns: Mapping[str | int, FloatArray]
    source: Source


@dataclass(frozen=True, slots=True)
class ChannelInfo:
    """One column or topic: how many samples, at which rate in Hz (NaN where unknown), what is inside, and the unit it states."""

    name: Annotated[str, Key("Its name.")]
    kind: Annotated[str, Key("Its type.", "type")]
    count: Annotated[int, Key("Number of samples.")]
    rate_hz: Annotated[Number, Key("Samples per second; null for the columns of a table, which share one clock.")]
    fields: Annotated[tuple[FieldInfo, ...], Key("What it holds.")]
    unit: str | None = None


@dataclass(frozen=True, slots=True, repr=False)
class Inventory(Brief):
    """What is in a log file; `table` says how a text table was understood, `samples` are a table's numbers.

    `more` are channels beyond the MOST_CHANNELS that were looked into. `frame` is that of a log of topics whose format has one,
    `by_topic` whether it is such a log. `no_clock` is the column of a table that is called its time, and why it is none.
    """

    path: Path
    form: str
    duration_s: float
    channels: tuple[ChannelInfo, ...]
    table: TableForm | None = None
    notes: tuple[Note, ...] = ()
    samples: Samples | None = None
    frame: str | None = None
    no_clock: tuple[Source, FieldsidError] | None = None
    more: int = 0

    @property
    def by_topic(self) -> bool:
        """Whether its signals are fields of topics, each on a clock of its own, and not columns of a table."""
        return self.form.endswith("bag") or self.frame is not None

    @property
    def is_named(self) -> bool:
        """Whether its columns have names: a text table may have none."""
        return self.table is None or bool(self.table.header)


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What a caller may ask of any reader: a folder of .msg files, and to take what is left of a damaged log.

    `command` is the one that imports the log as it is read here, for hints; `clock` the time column of a table that is listed,
    where a mapping names it. `joined` are the other tables of a run of which the log is one. `progress` is given which share of
    the log has been read, now and then.
    """

    msg_path: Path | None = None
    salvage: bool = False
    command: str = "sysid import LOG"
    clock: Source | None = None
    joined: tuple[Path, ...] = ()
    progress: Callable[[float], None] = lambda _: None

    def with_option(self, option: str) -> str:
        """Return the command that imports the log with one option more, into a folder of its own."""
        return f"`{self.command} {option} -o imported/`"

    def salvaging(self, words: str, left: float) -> str:
        """Return the hint to take what is left of a log, where that share of it is worth it; nothing elsewhere."""
        return f"{words}: {self.with_option('--salvage')}" if left >= WORTH_SALVAGING else ""


def never_canonical(path: Path, options: ReadOptions) -> ChannelMap | None:
    """Return None: the names of these logs are their own, and which output moves which fin is the vehicle's."""
    return None


@dataclass(frozen=True, slots=True)
class Reader:
    """One kind of log. `own_map` gives the mapping of a file whose names are canonical, or None when they are not."""

    name: str
    says: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path], bool]
    inventory: Callable[[Path, ReadOptions, TableForm], Inventory]
    read: Callable[[Path, ChannelMap, ReadOptions], RawLog]
    own_map: Callable[[Path, ReadOptions], ChannelMap | None] = never_canonical


def reader_of(path: Path, joined: Sequence[Path] = ()) -> Reader:
    """Return the reader that recognises a file, alone or with the other tables of its run, by its content.

    Raises LogError when one is missing, empty or unknown.
    """
    for file in (path, *joined):
        check_readable(file)
    known: dict[str, Reader] = dict(members(PACKAGE, "READER"))
    if joined:
        return known[JOINED]
    # Text is what is left when no signature of a binary format is there, so the table is asked last.
    for name in sorted(known, key=lambda n: (n == "csv_table", n)):
        if known[name].sniff(path):
            return known[name]
    raise not_a_log(path, [s for r in known.values() for s in r.suffixes])


def check_readable(path: Path) -> None:
    """Raise LogError when a log is not there, cannot be opened, is no file or folder, or is empty."""
    try:
        is_empty = _is_empty(path)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise _missing(path) from error
    except OSError as error:
        raise LogError(
            f"`{path}` cannot be read: {error.strerror or error}", found=f"in `{path.parent}`", hint=_way_in(path, error)
        ) from error
    if is_empty:
        raise LogError(f"`{path}` is empty", found="0 bytes", hint=COPY_AGAIN)


def _is_empty(path: Path) -> bool:
    """Whether a file holds nothing; raises OSError where it, or the folder it is, cannot be read."""
    if path.is_dir():
        next(path.iterdir(), None)
        return False
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode):
        what = "a pipe" if stat.S_ISFIFO(mode) else "a device"
        raise LogError(f"`{path}` is {what}, which can be read once only", found=what, hint="pipe the log in, and name it `-`")
    with path.open("rb") as stream:
        return not stream.read(1)


def _missing(path: Path) -> LogError:
    if path.is_symlink():
        return LogError(f"`{path}` is a link to nothing", found=f"it points to `{path.readlink()}`", hint="mend the link")
    return LogError(f"there is no log `{path}`", found=neighbours(path), hint=near_files(path))


def neighbours(path: Path) -> str:
    """Return what lies where a file was looked for."""
    folder = path.parent
    if not folder.is_dir() or not os.access(folder, os.R_OK):
        return f"no folder `{folder}` either"
    names = sorted(p.name for p in folder.iterdir() if not p.name.startswith("."))
    return f"`{folder}` holds {few_of(names) or 'nothing'}"


def _way_in(path: Path, error: OSError) -> str:
    """Return how one comes to read a file; nothing where its permissions are not what is in the way."""
    if not isinstance(error, PermissionError):
        return "check the path"
    try:
        found = path.stat()
    except OSError:  # what is closed is a folder above it
        return "ask the owner of its folder for it, or for the permission"
    if found.st_uid == getattr(os, "geteuid", lambda: None)():
        return f"`chmod u+{'rx' if stat.S_ISDIR(found.st_mode) else 'r'} {quote(str(path))}`"
    return "ask its owner for it, or for the permission"
