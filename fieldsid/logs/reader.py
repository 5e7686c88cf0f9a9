"""The interface of a reader: one file in readers/ with a `READER`, which recognises, lists and reads one kind of log."""

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
from fieldsid.logs.few_of import MOSTLY, few_of
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import COPY_AGAIN, not_a_log
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Interval, Key, Number
from fieldsid.records.reading import near_files
from fieldsid.registry import members

PACKAGE = "fieldsid.logs.readers"
DEFINED = "message"
"""The kind of a topic whose fields the format defines, so that their meaning is not guessed from names."""
MOST_CHANNELS = 5000
"""Largest number of channels of a log that are inspected, twice those of a glider; the others are only counted."""
SAMPLED = 100_000
"""Rows of a table that are in memory as text at once, and that are examined to guess the mapping."""
TABLE = "table"
"""The kind of a topic that is a separate file, whose fields are its columns."""
MOST_DEVICES = 32
"""Largest number of servos, motors and the like of one kind; names or a field with more are of no devices."""
JOINED = "several_tables"
"""The reader of a run in several tables."""


@dataclass(frozen=True, slots=True)
class Series:
    """One signal as it is logged: stamps (n,) in s, and numbers (n,) or quaternions (n, 4) as x y z w.

    `unit` is the unit that the file itself states. `is_height` marks a z coordinate, up in ENU.
    """

    time: FloatArray
    values: FloatArray
    label: str
    unit: str | None = None
    is_height: bool = False


@dataclass(frozen=True, slots=True)
class RawLog:
    """The result of a reader: series by canonical signal (or `attitude`), and its notes.

    `finished` marks a Run that this program wrote: its signals need no conversion.
    """

    name: str
    series: Mapping[str, Series]
    notes: tuple[Note, ...] = ()
    finished: bool = False
    one_clock: bool = True


@dataclass(frozen=True, slots=True)
class FieldInfo:
    """One field of a channel: its path (empty for a column), its type, its first values, and its smallest and largest value.

    `means` is the signal that the field is by the definition of the format, with the keys a mapping needs to read it.
    """

    path: Annotated[str, Key("Its path in a message; empty for the column of a table.")]
    kind: Annotated[str, Key("`number`, `text` or the message's own type.", "type")]
    first: Annotated[tuple[Any, ...], Key("Its first values.")]
    span: Annotated[
        tuple[float, float] | None, Key("Smallest and largest value; null where it is not a number.", of=Interval | None)
    ] = None
    means: tuple[str, Mapping[str, Any]] | None = None


def span_of(values: npt.NDArray[Any]) -> tuple[float, float] | None:
    """Return the smallest and largest finite number; None where there is none."""
    if values.dtype.kind not in "fiub":
        return None
    seen = values[np.isfinite(values)]
    return (float(seen.min()), float(seen.max())) if seen.size else None


def rate_of(time: FloatArray) -> float:
    """Return the rate in Hz of increasing stamps (n,) in s: the inverse of their median step; NaN where that is none."""
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    return 1.0 / step if step > 0.0 else float("nan")


@dataclass(frozen=True, slots=True)
class Samples:
    """The numbers of a table's columns (n,) by name or index, and its time (n,) in s, read from `source`."""

    time: FloatArray
    columns: Mapping[str | int, FloatArray]
    source: Source


@dataclass(frozen=True, slots=True)
class ChannelInfo:
    """One column or topic: its number of samples, its rate in Hz (NaN where unknown), its fields, and the unit it states."""

    name: Annotated[str, Key("Its name.")]
    kind: Annotated[str, Key("Its type.", "type")]
    count: Annotated[int, Key("Number of samples.")]
    rate_hz: Annotated[Number, Key("Samples per second; null for the columns of a table, which share one clock.")]
    fields: Annotated[tuple[FieldInfo, ...], Key("What it holds.")]
    unit: str | None = None


@dataclass(frozen=True, slots=True, repr=False)
class Inventory(Brief):
    """What is in a log file; `table` is the format that was detected for a text table, `samples` are the numbers of a table.

    `more` is the number of channels beyond the MOST_CHANNELS that were inspected. `frame` is the frame that the format of a log
    of topics defines, where it does. `no_clock` is the column that a table calls its time and that cannot be one, with the error.
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
        """Whether its signals are fields of topics, each with a separate clock, and not columns of a table."""
        return self.form.endswith("bag") or self.frame is not None

    @property
    def is_named(self) -> bool:
        """Whether its columns have names: a text table may have none."""
        return self.table is None or bool(self.table.header)


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """The options of any reader: a folder of .msg files, and `salvage`, to read what is readable of a damaged log.

    `command` is the command that imports the log with these options, for hints; `clock` the time column of a table that is
    listed, where a mapping names it. `joined` are the other tables where a run consists of several tables. `progress` is called
    repeatedly with the share of the log that has been read.
    """

    msg_path: Path | None = None
    salvage: bool = False
    command: str = "sysid import LOG"
    clock: Source | None = None
    joined: tuple[Path, ...] = ()
    progress: Callable[[float], None] = lambda _: None

    def with_option(self, option: str) -> str:
        """Return the command that imports the log with one more option, into the folder `imported/`."""
        return f"`{self.command} {option} -o imported/`"

    def salvaging(self, words: str, left: float) -> str:
        """Return the hint to salvage a log of which the share `left` is readable; empty where most of it is not."""
        return f"{words}: {self.with_option('--salvage')}" if left >= MOSTLY else ""


AS_IT_IS = ReadOptions()
"""The options of a reading that accepts no damage."""


def never_canonical(path: Path, options: ReadOptions) -> ChannelMap | None:
    """Return None, for logs whose names are never canonical: the vehicle decides which output moves which fin."""
    return None


@dataclass(frozen=True, slots=True)
class Reader:
    """One kind of log.

    `own_map` returns the mapping of a file whose names are canonical, or None where they are not. `names_of` returns the names of
    the columns of a table from the head of the file, and `table` the `Table` of the columns that a mapping names, or of all
    (`readers/_tables.py`); both are None for logs of topics.
    """

    name: str
    says: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path], bool]
    inventory: Callable[[Path, ReadOptions, TableForm], Inventory]
    read: Callable[[Path, ChannelMap, ReadOptions], RawLog]
    own_map: Callable[[Path, ReadOptions], ChannelMap | None] = never_canonical
    names_of: Callable[[Path], tuple[str, ...]] | None = None
    table: Callable[[Path, TableForm, ReadOptions, ChannelMap | None], Any] | None = None


def reader_of(path: Path, joined: Sequence[Path] = ()) -> Reader:
    """Return the reader that recognises a file by its content, or the reader of several tables where others are joined.

    Raises LogError when one is missing, empty or unknown.
    """
    for file in (path, *joined):
        check_readable(file)
    known: dict[str, Reader] = dict(members(PACKAGE, "READER"))
    if joined:
        return known[JOINED]
    # A text table has no signature, so its reader is tried last.
    for name in sorted(known, key=lambda n: (n == "csv_table", n)):
        if known[name].sniff(path):
            return known[name]
    raise not_a_log(path, [s for r in known.values() for s in r.suffixes])


def check_readable(path: Path) -> None:
    """Raise LogError where a log does not exist, cannot be opened, is neither a file nor a folder, or is empty."""
    try:
        is_empty = _is_empty(path)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise _missing(path) from error
    except OSError as error:
        raise LogError(
            f"`{path}` cannot be read: {error.strerror or error}", found=f"in `{path.parent}`", hint=_access_hint(path, error)
        ) from error
    if is_empty:
        raise LogError(f"`{path}` is empty", found="0 bytes", hint=COPY_AGAIN)


def _is_empty(path: Path) -> bool:
    """Whether a file is empty; raises OSError where the file or folder cannot be read."""
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
    """Return, in words, the content of the folder in which a file was expected."""
    folder = path.parent
    if not folder.is_dir() or not os.access(folder, os.R_OK):
        return f"no folder `{folder}` either"
    names = sorted(p.name for p in folder.iterdir() if not p.name.startswith("."))
    return f"`{folder}` holds {few_of(names) or 'nothing'}"


def _access_hint(path: Path, error: OSError) -> str:
    """Return the hint for a file that cannot be opened: how to obtain the permission, or to check the path."""
    if not isinstance(error, PermissionError):
        return "check the path"
    try:
        found = path.stat()
    except OSError:  # a folder above it is closed
        return "ask the owner of its folder for it, or for the permission"
    if found.st_uid == getattr(os, "geteuid", lambda: None)():
        return f"`chmod u+{'rx' if stat.S_ISDIR(found.st_mode) else 'r'} {quote(str(path))}`"
    return "ask its owner for it, or for the permission"
