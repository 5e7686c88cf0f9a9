"""Put a schedule under a key of an existing YAML file: comments and order kept, nothing else touched, the difference shown.

The file is round-tripped with the indentation that gives back its own text byte for byte; where no indentation does, the lines
of the key's block alone are replaced. The result is read again and must differ under that key alone.
"""

from __future__ import annotations

import difflib
import io
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.representer import RoundTripRepresenter

from fieldsid.artifacts import replacing
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.exports._target import decimal
from fieldsid.records.reading import read_bytes, yaml_mapping
from fieldsid.registry import near

INDENTS = tuple(product((2, 4), ((2, 0), (4, 2), (2, 2), (6, 4), (4, 4))))
LARGEST_PATCHED = 1 << 17
"""Letters of a file that is patched: it is read with its comments, and written in each of the indentations, in a few seconds."""
BY_HAND = "export with `-o FILE`, and copy the numbers"


class _Decimals(RoundTripRepresenter):
    """Writes plain floats, which are only ours (the file's own are ScalarFloat), with a decimal point and no exponent.

    A class of its own: a representer is registered for the class, and so for every YAML file of the process.
    """


_Decimals.add_representer(float, lambda r, v: r.represent_scalar("tag:yaml.org,2002:float", decimal(v)))


@dataclass(frozen=True, slots=True)
class Patch:
    """A change of one file: its text before and after, and the unified difference."""

    path: Path
    before: str
    after: str

    @property
    def difference(self) -> str:
        """The change as a unified difference, empty where there is none."""
        name = self.path.name
        lines = difflib.unified_diff(
            self.before.splitlines(keepends=True), self.after.splitlines(keepends=True), f"{name} (now)", f"{name} (new)", n=2
        )
        return "".join(line if line.endswith("\n") else line + "\n" for line in lines)


def patch_yaml(path: Path, key: str, columns: Mapping[str, Sequence[float]]) -> Patch:
    """Return the change that puts columns of numbers under a dotted key; nothing is written.

    Raises UsageError when the key is not in the file, ArtifactError when the file cannot be read or kept intact.
    """
    before = _text(path)
    _values(path, before)
    yaml, tree, regular = _parsed(before)
    parent, last = _find(path, tree, key)
    if regular:
        _put(parent, last, columns)
        stream = io.StringIO()
        yaml.dump(tree, stream)
        after = stream.getvalue()
    else:
        after = _spliced(path, before.replace("\r\n", "\n"), parent, last, columns)
    if "\r\n" in before:
        after = after.replace("\r\n", "\n").replace("\n", "\r\n")
    patch = Patch(path, before, after)
    _check(patch, key, columns)
    return patch


def patch_text(path: Path, text: str) -> Patch:
    """Return the change that makes a text of a whole file; raises ArtifactError where the file cannot be read."""
    return Patch(path, _text(path), text)


def write_patch(patch: Patch) -> Path:
    """Write a change in place and return the backup's path; raises ArtifactError where the file is read-only."""
    path = patch.path
    mode = path.stat().st_mode
    if not mode & 0o222 or not os.access(path, os.W_OK):
        raise ArtifactError(
            f"`{path}` is read-only",
            found=f"mode {mode & 0o777:o}",
            hint=f"`chmod u+w {path}`, or export to a file of its own with `-o`",
        )
    if _text(path) != patch.before:
        raise ArtifactError(f"`{path}` changed meanwhile", found="other text than was compared", hint="run the export again")
    backup = _free(path)
    with replacing(backup) as temporary:  # a copy that is interrupted is no backup
        shutil.copy2(path, temporary)
    with replacing(path, force=True) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        stream.write(patch.after)
    path.chmod(mode & 0o777)
    return backup


def _text(path: Path) -> str:
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise ArtifactError(f"`{path}` cannot be read", found=str(error), hint="check the path given to `--into`") from error


def _values(path: Path, text: str) -> dict[str, Any]:
    """Return what the text says; raises ArtifactError where it is none of what is read, as with tags of its own."""
    if len(text) > LARGEST_PATCHED:
        found = f"{len(text)} letters, more than {LARGEST_PATCHED}"
        raise ArtifactError(f"`{path}` could not be patched safely", found=found, hint=BY_HAND)
    try:
        return yaml_mapping(text.replace("\r\n", "\n"), path)
    except ArtifactError as error:
        raise ArtifactError(
            f"`{path}` could not be patched safely", found=f"{error.what}: {error.found}", hint=BY_HAND
        ) from error


def _parsed(text: str) -> tuple[YAML, CommentedMap, bool]:
    """Return a parser, the tree, and whether the parser's indentation gives the text back."""
    source = text.replace("\r\n", "\n")
    for quotes in (True, False):
        tree = _parser(2, 2, 0, quotes=quotes).load(source)
        for mapping, (sequence, offset) in INDENTS:
            yaml = _parser(mapping, sequence, offset, quotes=quotes)
            if _gives_back(yaml, tree, source):
                return yaml, tree, True
    yaml = _parser(2, 2, 0, quotes=True)
    return yaml, yaml.load(source), False


def _gives_back(yaml: YAML, tree: CommentedMap, source: str) -> bool:
    stream = _Same(source)
    try:
        yaml.dump(tree, stream)
    except _OtherError:
        return False
    return stream.tell() == len(source)


class _OtherError(Exception):
    """Text that is written is not the one it is to be."""


class _Same(io.StringIO):
    """Takes a text as long as it is one that is given: most indentations are wrong from the first lines on."""

    def __init__(self, wanted: str) -> None:
        super().__init__()
        self._wanted = wanted

    def write(self, text: str) -> int:
        """Take a piece of text; raises _OtherError where it is not what stands at its place."""
        if not self._wanted.startswith(text, self.tell()):
            raise _OtherError
        return super().write(text)


def _spliced(path: Path, text: str, parent: CommentedMap, last: str, columns: Mapping[str, Sequence[float]]) -> str:
    """Return the text with the lines of the key's block replaced; raises ArtifactError inside a flow mapping."""
    if parent.fa.flow_style():
        raise ArtifactError(
            f"`{path}`: `{last}` stands inside braces and cannot be replaced alone",
            found=f"line {parent.lc.line + 1}",
            hint="write that mapping in block style, one key per line",
        )
    row, column = parent.lc.key(last)
    lines = text.splitlines(keepends=True)
    end = row + 1
    for i in range(row + 1, len(lines)):
        words = lines[i].strip()
        if not words or words.startswith("#"):
            continue
        depth = len(lines[i]) - len(lines[i].lstrip())
        if depth < column or (depth == column and not words.startswith("- ")):
            break
        end = i + 1
    head = lines[row][: lines[row].index(":", column) + 1] + "\n"
    own = [f"{' ' * (column + 2)}{n}: [{', '.join(decimal(v) for v in vs)}]\n" for n, vs in columns.items()]
    return "".join([*lines[:row], head, *own, *lines[end:]])


def _parser(mapping: int, sequence: int, offset: int, *, quotes: bool) -> YAML:
    yaml = YAML()
    yaml.preserve_quotes = quotes
    yaml.width = 100_000
    yaml.indent(mapping=mapping, sequence=sequence, offset=offset)
    yaml.Representer = _Decimals
    return yaml


def _find(path: Path, tree: CommentedMap, key: str) -> tuple[CommentedMap, Any]:
    here: Any = tree
    parts = _parts(key)
    for depth, part in enumerate(parts):
        if not isinstance(here, CommentedMap) or part not in here:
            known = [str(k) for k in here] if isinstance(here, CommentedMap) else []
            place = ".".join(parts[:depth]) or "the top"
            raise UsageError(
                f"key `{key}` is not in `{path}`: nothing named `{part}` under {place}",
                found=", ".join(known) or "no keys there",
                hint=near(part, known) if known else "name a key that holds a mapping",
            )
        if depth == len(parts) - 1:
            return here, part
        here = here[part]
    raise UsageError("`--key` is empty", found=repr(key), hint="write `--key control.heading.gains`")


def _parts(key: str) -> list[str]:
    return [p for p in key.split(".") if p]


def _put(parent: CommentedMap, last: str, columns: Mapping[str, Sequence[float]]) -> None:
    """Set the columns under the key; keys that are there already keep their place and comments."""
    held = parent[last]
    if not isinstance(held, CommentedMap) or held.fa.flow_style():
        held = CommentedMap()
        parent[last] = held
    for name in [k for k in held if k not in columns]:
        del held[name]
    for name, values in columns.items():
        row = CommentedSeq([float(v) for v in values])
        row.fa.set_flow_style()
        held[name] = row


def _check(patch: Patch, key: str, columns: Mapping[str, Sequence[float]]) -> None:
    """Refuse a change that says something else than the columns under the key, or anything else elsewhere."""
    old, new = (_values(patch.path, text) for text in (patch.before, patch.after))
    parts = _parts(key)
    for tree in (old, new):
        here = tree
        for part in parts[:-1]:
            here = here[part]
        found = here.pop(parts[-1])
    if old != new or {k: [float(v) for v in vs] for k, vs in found.items()} != {k: list(v) for k, v in columns.items()}:
        raise ArtifactError(
            f"`{patch.path}` could not be patched safely", found="other keys would change", hint="export with `-o FILE` instead"
        )


def _free(path: Path) -> Path:
    """Return the first backup name that is not taken: FILE.bak, FILE.bak2, ..."""
    backup = path.with_name(f"{path.name}.bak")
    number = 1
    while backup.exists():
        number += 1
        backup = path.with_name(f"{path.name}.bak{number}")
    return backup
