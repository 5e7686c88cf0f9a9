"""The input files that a record names: they are looked for in its trial or next to it, and identified by their SHA-256.

A record may come from anybody and name any path. A path that is not a plain file or folder, lies elsewhere, or is larger than the
limits here is treated as missing: a device has no end, and hashing a file system takes hours.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any

from fieldsid.errors import ArtifactError
from fieldsid.records.reading import read_yaml

LARGEST_HASHED = 1 << 28
"""Most bytes of a named file, or of all files of a named folder, that are hashed: this takes at most a second."""
MOST_HASHED = 1000
"""Most files and folders in a named folder, such as a bag, for which it is hashed."""
ABOVE = 4
"""Number of folders above a record that are searched: up to two in its trial (`final/speeds`), the trial, and the folder that
contains the trial."""


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes as 64 hex digits; a folder's is that of its files in name order."""
    digest = hashlib.sha256()
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    for file in files:
        with file.open("rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()


def size_and_time(path: Path) -> tuple[int, int]:
    """Return the size in bytes and the newest modification time in ns of a file, or of all files in a folder."""
    files = [p for p in path.rglob("*") if p.is_file()] if path.is_dir() else [path]
    found = [p.stat() for p in files if p.exists()]
    return sum(s.st_size for s in found), max((s.st_mtime_ns for s in found), default=0)


def sha256_of_named(path: Path) -> str | None:
    """Return the SHA-256 of a file or folder that a record or a trial names; None where it is missing or beyond the limits."""
    if os.path.isdir(path):  # noqa: PTH112 - says no of what cannot be a path, and does not raise
        entries = list(islice(path.rglob("*"), MOST_HASHED + 1))
        files = [p for p in entries if p.is_file()] if len(entries) <= MOST_HASHED else []
    else:
        files = [path] if is_there(path) else []
    try:
        return sha256_of(path) if files and sum(p.stat().st_size for p in files) <= LARGEST_HASHED else None
    except OSError:  # not readable by this user: treated as missing
        return None


def is_there(path: Path) -> bool:
    """Whether a path is that of a plain file or of a folder; false for any text that cannot be a path."""
    return os.path.isfile(path) or os.path.isdir(path)  # noqa: PTH112, PTH113 - say no where a path cannot be one


def first_allowed(places: Iterable[Path], trial: Path) -> Path | None:
    """Return the first path that exists within the parent folder of the trial or of the working folder; None without one."""
    allowed = [Path(os.path.abspath(p)).parent for p in (trial, Path())]  # noqa: PTH100 - a link counts where it lies
    for place in places:
        absolute = Path(os.path.abspath(place))  # noqa: PTH100
        if is_there(place) and any(absolute.is_relative_to(a) for a in allowed):
            return place
    return None


def inputs_of(path: Path) -> tuple[Path, ...]:
    """Return the existing input files that a record names; empty where the record cannot be read."""
    try:
        return inputs_in(read_yaml(path), path)
    except ArtifactError:
        return ()


def inputs_in(body: Mapping[str, Any], record: Path) -> tuple[Path, ...]:
    """Return the existing input files that the body of a record names."""
    named = body.get("inputs")
    entries = [e for e in named if isinstance(e, Mapping)] if isinstance(named, list) else []
    found = (where_now(e, record) for e in entries)
    return tuple(dict.fromkeys(p for p in found if p is not None))


def mapping_of(records: Iterable[Path]) -> Path | None:
    """Return the first mapping that one of the records names, as `mapping_in` does; None where none names one."""
    for path in records:
        with suppress(ArtifactError):
            if (mapping := mapping_in(read_yaml(path), path)) is not None:
                return mapping
    return None


def mapping_in(body: Mapping[str, Any], record: Path) -> Path | None:
    """Return the mapping with which a record's logs were read; None where the body names none or it is missing."""
    entry = body.get("mapping")
    return where_now(entry, record) if isinstance(entry, Mapping) else None


def where_now(entry: Mapping[str, Any], record: Path) -> Path | None:
    """Return the path, from the working folder, of a file that a record names with its SHA-256; None where it is missing.

    A record names its files from the folder in which it was made. Where the path does not exist, it is therefore looked for from
    the folders above the record, and accepted where its hash is right.
    """
    named = entry.get("path")
    if not isinstance(named, str) or not named:
        return None
    path = Path(named)
    folders = list(islice(record.resolve().parents, ABOVE))
    trial = folders[min(1, len(folders) - 1)]
    if (there := first_allowed([path], trial)) is not None or path.is_absolute():
        return there
    above = (p for p in _places(path, folders, trial) if sha256_of_named(p) == entry.get("sha256"))
    found = next(above, None)
    return None if found is None else Path(os.path.relpath(found))


def _places(path: Path, folders: Iterable[Path], trial: Path) -> Iterator[Path]:
    return (p for folder in folders if (p := first_allowed([folder / path], trial)) is not None)
