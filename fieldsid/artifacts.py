"""Write files with schema, version, and hashes of the inputs and the parent; each completely or not at all."""

from __future__ import annotations

import io
import math
import os
import secrets
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.scalarstring import LiteralScalarString

from fieldsid._version import __version__
from fieldsid.errors import FULL, MAKE_ROOM, ArtifactError
from fieldsid.records.keys import body_of, has_keys
from fieldsid.records.named_inputs import sha256_of

OWN_HANDLES = Path("/proc/self/fd")
"""Folder in which Linux lists the open files of a process by descriptor, through which a file without a name can be linked."""


def check_output(path: Path, *, force: bool = False) -> None:
    """Raise ArtifactError where a file cannot be written: it exists and `force` is false, or no folder is writable there."""
    if os.path.isdir(path):  # noqa: PTH112 - says no where a folder is closed, and does not raise
        raise ArtifactError(f"`{path}` is a folder, not a file", found="a folder", hint=f"name a file in it: `{path}/NAME`")
    if os.path.exists(path) and not force:  # noqa: PTH110 - says no where a folder is closed, and does not raise
        raise ArtifactError(
            f"`{path}` exists", found=f"{path.stat().st_size} bytes", hint="add `--force`, or name another output"
        )
    above = next((p for p in path.parents if os.path.lexists(p)), Path())
    if not above.is_dir():
        raise ArtifactError(f"`{above}` is a file, not a folder", found=f"{above.stat().st_size} bytes", hint="name a folder")
    if not os.access(above, os.W_OK | os.X_OK):
        raise ArtifactError(
            f"`{path}` cannot be written: Permission denied", found=f"folder `{above}`", hint="name a place that can be written"
        )


@contextmanager
def replacing(path: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield a temporary path to write to, which becomes `path` when the block ends without an error.

    Raises ArtifactError where `path` exists and `force` is false, or where it cannot be written; then no temporary file remains
    and an existing file is unchanged. Where the system has files without a name, none remains after a killed process either.
    """
    check_output(path, force=force)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            handle = _open_unnamed(path.parent)
            temporary = stack.enter_context(_hidden_file(path) if handle is None else _at_handle(handle))
            yield temporary
            temporary.chmod(0o666 & ~_umask())
            if handle is not None:
                temporary = stack.enter_context(_linked_to_hidden_name(handle, path))
            temporary.replace(path)
    except OSError as error:
        raise ArtifactError(
            f"`{path}` cannot be written: {error.strerror or error}",
            found=f"folder `{path.parent}`",
            hint=MAKE_ROOM if error.errno in FULL else "name a place that can be written",
        ) from error


def _open_unnamed(folder: Path) -> int | None:
    """Return the descriptor of an open file without a name in a folder; None where system or disk do not support it."""
    if not hasattr(os, "O_TMPFILE") or not OWN_HANDLES.is_dir():
        return None
    try:
        return os.open(folder, os.O_TMPFILE | os.O_RDWR, 0o600)
    except OSError:  # an error of the folder is raised again when a file with a name is created in it
        return None


@contextmanager
def _at_handle(handle: int) -> Iterator[Path]:
    try:
        yield OWN_HANDLES / str(handle)
    finally:
        os.close(handle)


@contextmanager
def _hidden_file(path: Path) -> Iterator[Path]:
    """Yield a hidden file in the folder of a path, removed at the end unless it was moved."""
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    try:
        yield Path(name)
    finally:
        Path(name).unlink(missing_ok=True)


@contextmanager
def _linked_to_hidden_name(handle: int, path: Path) -> Iterator[Path]:
    """Yield a hidden name, in the folder of a path, for a file without one: a link cannot replace a file, a rename can."""
    name = path.parent / f".{path.name}.{secrets.token_hex(6)}{path.suffix}"
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        # with the folder's descriptor: only then does Python let the system follow the link in OWN_HANDLES
        os.link(OWN_HANDLES / str(handle), name.name, dst_dir_fd=folder, follow_symlinks=True)
        yield name
    finally:
        os.close(folder)
        name.unlink(missing_ok=True)


def write_text(path: Path, text: str, *, force: bool = False) -> Path:
    """Write a text file completely or not at all; raises ArtifactError."""
    with replacing(path, force=force) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace")  # of a name that is no UTF-8
    return path


def save_record(
    path: Path,
    schema: str,
    body: Mapping[str, Any],
    *,
    inputs: Sequence[Path] = (),
    mapping: Path | None = None,
    parent: Path | None = None,
    force: bool = False,
) -> Path:
    """Write a record as YAML under a head of schema, version, input hashes and parent; raises ArtifactError.

    mapping: the file that the inputs were read with, where they are not read without it.
    """
    head: dict[str, Any] = {
        "schema": schema,
        "tool": f"fieldsid {__version__}",
        "inputs": [{"path": str(p), "sha256": sha256_of(p)} for p in inputs],
        **({} if mapping is None else {"mapping": {"path": str(mapping), "sha256": sha256_of(mapping)}}),
        "parent": None if parent is None else {"path": str(parent), "sha256": sha256_of(parent)},
    }
    return write_text(path, to_yaml({**head, **body}), force=force)


def to_yaml(body: Mapping[str, Any]) -> str:
    """Return a mapping as block YAML in the given order, numbers as plain YAML numbers."""
    yaml = YAML()
    yaml.default_flow_style = False
    yaml.width = 120
    stream = io.StringIO()
    yaml.dump(plain(body), stream)
    return stream.getvalue()


def plain(value: Any) -> Any:  # noqa: PLR0911 - one return per kind of value
    """Return a value as nested dict, list and plain numbers; numbers that are not finite become None, a record its JSON."""
    if has_keys(value):
        return plain(body_of(value))
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value if value is None or isinstance(value, LiteralScalarString) else str(value)


def block(text: str) -> str:
    """Return a text of several lines that `to_yaml` writes line by line, not as one quoted line."""
    literal: str = LiteralScalarString(text)
    return literal


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
