"""The contract of a reader: one file in readers/ with a `READER`; it recognises, lists and reads one kind of log."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fieldsid.errors import LogError
from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.run import FloatArray, Note
from fieldsid.registry import members

PACKAGE = "fieldsid.logs.readers"


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
    """One number inside a channel: its path (empty for a column), its type, first values, least and largest (a column's)."""

    path: str
    kind: str
    first: tuple[Any, ...]
    span: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class ChannelInfo:
    """One column or topic: how many samples, at which rate in Hz (NaN where unknown), and what is inside."""

    name: str
    kind: str
    count: int
    rate_hz: float
    fields: tuple[FieldInfo, ...]


@dataclass(frozen=True, slots=True)
class Inventory:
    """What is in a log file; `table` says how a text table was understood."""

    path: Path
    form: str
    duration_s: float
    channels: tuple[ChannelInfo, ...]
    table: TableForm | None = None
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What a caller may ask of any reader: a folder of .msg files, and to take what is left of a damaged log."""

    msg_path: Path | None = None
    salvage: bool = False


@dataclass(frozen=True, slots=True)
class Reader:
    """One kind of log. `own_map` gives the mapping of a file whose names are canonical, or None when they are not."""

    name: str
    says: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path], bool]
    inventory: Callable[[Path, ReadOptions, TableForm], Inventory]
    read: Callable[[Path, ChannelMap, ReadOptions], RawLog]
    own_map: Callable[[Path, ReadOptions], ChannelMap | None]


def reader_of(path: Path) -> Reader:
    """Return the reader that recognises a file by its content; raises LogError when it is missing, empty or unknown."""
    check_readable(path)
    known: dict[str, Reader] = dict(members(PACKAGE, "READER"))
    # Text is what is left when no signature of a binary format is there, so the table is asked last.
    for name in sorted(known, key=lambda n: (n == "csv_table", n)):
        if known[name].sniff(path):
            return known[name]
    raise LogError(
        f"`{path}` is no log this program reads",
        found=f"{'a folder' if path.is_dir() else f'{path.stat().st_size} bytes'} with no known signature",
        hint=f"give one of: {', '.join(s for r in known.values() for s in r.suffixes)}",
    )


def check_readable(path: Path) -> None:
    """Raise LogError when a log is not there, cannot be opened, or is empty."""
    if not path.exists():
        raise LogError(f"there is no log `{path}`", found=_neighbours(path), hint="check the path")
    if path.is_dir():
        return
    try:
        with path.open("rb") as stream:
            is_empty = not stream.read(1)
    except OSError as error:
        raise LogError(
            f"`{path}` cannot be read: {error.strerror or error}", found=str(path), hint=f"try `chmod u+r {path}`"
        ) from error
    if is_empty:
        raise LogError(f"`{path}` is empty", found="0 bytes", hint="copy it from the vehicle again")


def _neighbours(path: Path) -> str:
    folder = path.parent
    if not folder.is_dir():
        return f"no folder `{folder}` either"
    names = sorted(p.name for p in folder.iterdir() if not p.name.startswith("."))
    shown = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
    return f"`{folder}` holds {shown or 'nothing'}"
