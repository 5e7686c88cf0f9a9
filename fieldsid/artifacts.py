"""Files the tool writes: schema, version, hashes of the inputs and the parent; written whole or not at all."""

from __future__ import annotations

import difflib
import hashlib
import io
import math
import os
import secrets
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.scalarstring import LiteralScalarString

from fieldsid._version import __version__
from fieldsid.errors import ArtifactError

OWN_HANDLES = Path("/proc/self/fd")
"""Where Linux shows a process the files that it has open, by their number: the way to one that has no name."""


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes as 64 hex digits; a folder's is that of its files in name order."""
    digest = hashlib.sha256()
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    for file in files:
        with file.open("rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()


def check_output(path: Path, *, force: bool = False) -> None:
    """Raise ArtifactError where a file cannot be written: it exists and `force` is false, or its place cannot hold it."""
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

    Raises ArtifactError when `path` exists and `force` is false, or when it cannot be written; then nothing
    is left behind and an existing file is as it was. Where the system has files without a name, nothing is left behind
    either by a process that is killed.
    """
    check_output(path, force=force)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            handle = _nameless(path.parent)
            temporary = stack.enter_context(_named(path) if handle is None else _at_handle(handle))
            yield temporary
            temporary.chmod(0o666 & ~_umask())
            if handle is not None:
                temporary = stack.enter_context(_given_a_name(handle, path))
            temporary.replace(path)
    except OSError as error:
        raise ArtifactError(
            f"`{path}` cannot be written: {error.strerror or error}",
            found=f"folder `{path.parent}`",
            hint="name a place that can be written",
        ) from error


def _nameless(folder: Path) -> int | None:
    """Return an open file of a folder that has no name there; None where the system or the folder's disk has no such files."""
    if not hasattr(os, "O_TMPFILE") or not OWN_HANDLES.is_dir():
        return None
    try:
        return os.open(folder, os.O_TMPFILE | os.O_RDWR, 0o600)
    except OSError:  # what is wrong with the folder is met again, and said, where a named file is made in it
        return None


@contextmanager
def _at_handle(handle: int) -> Iterator[Path]:
    try:
        yield OWN_HANDLES / str(handle)
    finally:
        os.close(handle)


@contextmanager
def _named(path: Path) -> Iterator[Path]:
    """Yield a hidden file beside a path, gone at the end unless it was moved."""
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    try:
        yield Path(name)
    finally:
        Path(name).unlink(missing_ok=True)


@contextmanager
def _given_a_name(handle: int, path: Path) -> Iterator[Path]:
    """Yield a hidden name beside a path for a file that has none: a link does not replace what is there, a name can."""
    name = path.parent / f".{path.name}.{secrets.token_hex(6)}{path.suffix}"
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        # by the folder's handle: only then Python asks the system to follow the link that the handle's path is
        os.link(OWN_HANDLES / str(handle), name.name, dst_dir_fd=folder, follow_symlinks=True)
        yield name
    finally:
        os.close(folder)
        name.unlink(missing_ok=True)


def write_text(path: Path, text: str, *, force: bool = False) -> Path:
    """Write a text file whole or not at all; raises ArtifactError."""
    with replacing(path, force=force) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def save_record(
    path: Path,
    schema: str,
    body: Mapping[str, Any],
    *,
    inputs: Sequence[Path] = (),
    parent: Path | None = None,
    force: bool = False,
) -> Path:
    """Write a record as YAML under a head of schema, version, input hashes and parent; raises ArtifactError."""
    head: dict[str, Any] = {
        "schema": schema,
        "tool": f"fieldsid {__version__}",
        "inputs": [{"path": str(p), "sha256": sha256_of(p)} for p in inputs],
        "parent": None if parent is None else {"path": str(parent), "sha256": sha256_of(parent)},
    }
    return write_text(path, to_yaml({**head, **body}), force=force)


def load_record(path: Path, kind: str) -> dict[str, Any]:
    """Read a record back and check that it is one of `kind` (`fieldsid/model` for `fieldsid/model/1`).

    Raises ArtifactError when the file cannot be read, is not YAML, or is another kind of record.
    """
    body = read_yaml(path)
    schema = body.get("schema")
    if not isinstance(schema, str) or not schema.startswith(f"{kind}/"):
        raise ArtifactError(
            f"`{path}` is not a {kind} file",
            found=f"schema: {schema!r}",
            hint=f"give a file with a line `schema: {kind}/1`",
        )
    if schema != f"{kind}/1":
        number = schema.rpartition("/")[2]
        if number.isdecimal() and int(number) > 1:
            raise ArtifactError(f"`{path}` has a newer schema than this version reads", found=schema, hint="update fieldsid")
        raise ArtifactError(f"`{path}` has a schema that there is not", found=schema, hint=f"such a file has `schema: {kind}/1`")
    return body


@lru_cache(maxsize=32)
def _parsed(text: str) -> object:
    """Return what a YAML text says: a command asks a model's file again and again, and parsing it takes 25 ms."""
    return YAML(typ="safe").load(text)


def read_yaml(path: Path) -> dict[str, Any]:
    """Read a YAML mapping; raises ArtifactError when it cannot be read or is not a mapping."""
    return yaml_mapping(read_text(path), path)


def read_text(path: Path) -> str:
    """Read a text file; raises ArtifactError when it cannot be read or is no text."""
    try:
        return path.read_text(encoding="utf-8")
    except IsADirectoryError as error:
        held = sorted(p.name for p in path.iterdir())
        found = f"it holds {', '.join(held[:3])}{' ...' if len(held) > 3 else ''}" if held else "it is empty"
        raise ArtifactError(f"`{path}` is a folder, where a file is needed", found=found, hint="name a file in it") from error
    except OSError as error:
        raise ArtifactError(
            f"`{path}` cannot be read: {error.strerror}",
            found=f"in `{path.parent}`",
            hint=near_files(path) if isinstance(error, FileNotFoundError) else "check its permissions",
        ) from error
    except UnicodeDecodeError as error:
        raise ArtifactError(
            f"`{path}` is not YAML, nor any text", found=str(error), hint="give a file with `key: value` lines"
        ) from error


def yaml_mapping(text: str, path: Path) -> dict[str, Any]:
    """Return the mapping that a YAML text holds; raises ArtifactError naming the file it came from."""
    try:
        body = deepcopy(_parsed(text))
    except YAMLError as error:
        mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None)
        found = str(error).strip() if mark is None else f"line {mark.line + 1}, column {mark.column + 1}: {problem}"
        raise ArtifactError(f"`{path}` is not valid YAML", found=found, hint="mend the line named above") from error
    except (ValueError, RecursionError) as error:  # a date that there is not, brackets without end
        found = f"{type(error).__name__}: {error}"
        raise ArtifactError(f"`{path}` holds a value that YAML cannot read", found=found, hint="put text in quotes") from error
    if not isinstance(body, dict):
        raise ArtifactError(f"`{path}` holds no keys with values", found=_shape_of(body), hint="write `key: value` lines")
    return body


def near_files(path: Path) -> str:
    """Return what a file that is not there may have meant."""
    names = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() and os.access(path.parent, os.R_OK) else []
    close = difflib.get_close_matches(path.name, names, n=1)
    return f"did you mean `{quote(str(path.parent / close[0]))}`?" if close else "check the path"


def _shape_of(body: object) -> str:
    return "nothing" if body is None else "a list" if isinstance(body, list) else f"the text {str(body)[:40]!r}"


def inputs_of(path: Path) -> tuple[Path, ...]:
    """Return the files that a record says it was made from, those that are still there; none where it cannot be read."""
    try:
        inputs = read_yaml(path).get("inputs")
        named = [where_now(entry, path) for entry in inputs or ()]
    except (ArtifactError, TypeError, KeyError):
        return ()
    return tuple(p for p in dict.fromkeys(named) if p.exists())


def where_now(entry: Mapping[str, Any], record: Path) -> Path:
    """Return the path of a file that a record names with its SHA-256, as seen from the working folder.

    What is not there is looked for from every folder above the record, and known by its hash: a record tells its files from the
    folder where it was made.
    """
    path = Path(str(entry["path"]))
    if path.is_absolute() or path.exists():
        return path
    above = (folder / path for folder in record.resolve().parents)
    found = next((p for p in above if p.exists() and sha256_of(p) == entry.get("sha256")), None)
    return path if found is None else Path(os.path.relpath(found))


def to_yaml(body: Mapping[str, Any]) -> str:
    """Return a mapping as block YAML in its own order, numbers as plain YAML numbers."""
    yaml = YAML()
    yaml.default_flow_style = False
    yaml.width = 120
    stream = io.StringIO()
    yaml.dump(plain(body), stream)
    return stream.getvalue()


def plain(value: Any) -> Any:  # noqa: PLR0911 - one return per kind of value
    """Return a value as nested dict, list and plain numbers; numbers that are not finite become None."""
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
