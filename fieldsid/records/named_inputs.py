"""Files that a record names as what it was made from: looked for inside or beside its trial, known by their SHA-256.

A record may come from anybody and name anything. What is no plain file, lies elsewhere or is larger than is stated here is as
if it were not there: a device has no end, and the files of a whole system take hours.
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
"""Bytes of a file that a record names, or of all files of a folder, up to which they are hashed: a second at the most."""
MOST_HASHED = 1000
"""Files and folders in a folder that a record names, as a bag is one, up to which it is hashed."""
ABOVE = 3
"""Folders above a record that its trial, and what lies beside that, can be: `models` of it, the trial, and the one it lies in."""


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes as 64 hex digits; a folder's is that of its files in name order."""
    digest = hashlib.sha256()
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    for file in files:
        with file.open("rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()


def sha256_of_named(path: Path) -> str | None:
    """Return the SHA-256 of a file or folder that a record or a trial's folder names; None for what is not hashed here."""
    if os.path.isdir(path):  # noqa: PTH112 - says no of what cannot be a path, and does not raise
        held = list(islice(path.rglob("*"), MOST_HASHED + 1))
        files = [p for p in held if p.is_file()] if len(held) <= MOST_HASHED else []
    else:
        files = [path] if is_there(path) else []
    try:
        return sha256_of(path) if files and sum(p.stat().st_size for p in files) <= LARGEST_HASHED else None
    except OSError:  # closed to this user: as if it were not there
        return None


def is_there(path: Path) -> bool:
    """Whether a path is that of a plain file or of a folder; false of any text that can be none."""
    return os.path.isfile(path) or os.path.isdir(path)  # noqa: PTH112, PTH113 - say no where a path cannot be one


def beside(places: Iterable[Path], trial: Path) -> Path | None:
    """Return the first of some places that is a plain file or a folder, inside a trial, beside it or where the program runs."""
    allowed = [Path(os.path.abspath(p)).parent for p in (trial, Path())]  # noqa: PTH100 - a link counts where it lies
    for place in places:
        whole = Path(os.path.abspath(place))  # noqa: PTH100
        if is_there(place) and any(whole.is_relative_to(a) for a in allowed):
            return place
    return None


def inputs_of(path: Path) -> tuple[Path, ...]:
    """Return the files that a record says it was made from, those that are still there; none where it cannot be read."""
    try:
        return inputs_in(read_yaml(path), path)
    except ArtifactError:
        return ()


def inputs_in(body: Mapping[str, Any], record: Path) -> tuple[Path, ...]:
    """Return the files that a record's body says it was made from, those that are still there."""
    named = body.get("inputs")
    entries = [e for e in named if isinstance(e, Mapping)] if isinstance(named, list) else []
    found = (where_now(e, record) for e in entries)
    return tuple(dict.fromkeys(p for p in found if p is not None))


def mapping_of(records: Iterable[Path]) -> Path | None:
    """Return the first mapping that the logs of some records were read with, as `mapping_in` does; None where none names one."""
    for path in records:
        with suppress(ArtifactError):
            if (mapping := mapping_in(read_yaml(path), path)) is not None:
                return mapping
    return None


def mapping_in(body: Mapping[str, Any], record: Path) -> Path | None:
    """Return the mapping that a record's body says its logs were read with, where it still is; None where none was named."""
    entry = body.get("mapping")
    return where_now(entry, record) if isinstance(entry, Mapping) else None


def where_now(entry: Mapping[str, Any], record: Path) -> Path | None:
    """Return the path of a file that a record names with its SHA-256, as seen from the working folder; None where it is nowhere.

    What is not there is looked for from the folders above the record, and known by its hash: a record tells its files from the
    folder where it was made.
    """
    named = entry.get("path")
    if not isinstance(named, str) or not named:
        return None
    path = Path(named)
    folders = list(islice(record.resolve().parents, ABOVE))
    trial = folders[min(1, len(folders) - 1)]
    if (there := beside([path], trial)) is not None or path.is_absolute():
        return there
    above = (p for p in _places(path, folders, trial) if sha256_of_named(p) == entry.get("sha256"))
    found = next(above, None)
    return None if found is None else Path(os.path.relpath(found))


def _places(path: Path, folders: Iterable[Path], trial: Path) -> Iterator[Path]:
    return (p for folder in folders if (p := beside([folder / path], trial)) is not None)
