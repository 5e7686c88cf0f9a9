"""Write a schedule under a key of an existing YAML file, with comments and order preserved, and show the difference.

Only the text of the key's value is replaced. The result is parsed again and must differ under that key only.
"""

from __future__ import annotations

import difflib
import os
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.nodes import MappingNode, Node, SequenceNode

from fieldsid.artifacts import replacing
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.exports._target import decimal
from fieldsid.records.reading import read_bytes, yaml_mapping
from fieldsid.registry import near

BY_HAND = "export with `-o FILE`, and copy the numbers"


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
    text = before.replace("\r\n", "\n")
    parent, name, value = _find(path, YAML(typ="safe", pure=True).compose(text), key)
    after = _text_with_columns(text, parent, name, value, columns)
    if "\r\n" in before:
        after = after.replace("\n", "\r\n")
    patch = Patch(path, before, after)
    _check(patch, key, columns)
    return patch


def patch_text(path: Path, text: str) -> Patch:
    """Return the change that replaces the text of a file; raises ArtifactError where the file cannot be read."""
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
    backup = _free_backup_name(path)
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
    """Return the mapping of a YAML text; raises ArtifactError where it is not valid or has custom tags."""
    try:
        return yaml_mapping(text.replace("\r\n", "\n"), path)
    except ArtifactError as error:
        raise ArtifactError(
            f"`{path}` could not be patched safely", found=f"{error.what}: {error.found}", hint=BY_HAND
        ) from error


def _find(path: Path, tree: Node, key: str) -> tuple[Any, Node, Node]:
    """Return the mapping with a dotted key, the node of the key, and that of its value."""
    parts = _parts(key)
    for depth, part in enumerate(parts):
        keys = {name.value: (name, value) for name, value in tree.value} if isinstance(tree, MappingNode) else {}
        if part not in keys:
            place = ".".join(parts[:depth]) or "the top"
            raise UsageError(
                f"key `{key}` is not in `{path}`: nothing named `{part}` under {place}",
                found=", ".join(keys) or "no keys there",
                hint=near(part, list(keys)) if keys else "name a key that holds a mapping",
            )
        parent, (name, tree) = tree, keys[part]
    if not parts:
        raise UsageError("`--key` is empty", found=repr(key), hint="write `--key control.heading.gains`")
    return parent, name, tree


def _parts(key: str) -> list[str]:
    return [p for p in key.split(".") if p]


def _text_with_columns(text: str, parent: Any, name: Node, value: Node, columns: Mapping[str, Sequence[float]]) -> str:
    """Return the text with the columns as a key's value; existing keys keep their place and comments."""
    rows = {n: f": [{', '.join(decimal(v) for v in vs)}]" for n, vs in columns.items()}
    begin, end = name.end_mark.index, _end_of_value(text, name, value)
    if parent.flow_style:
        return f"{text[:begin]}: {{{', '.join(n + row for n, row in rows.items())}}}{text[end:]}"
    inside = isinstance(value, MappingNode) and not value.flow_style and value.start_mark.index > begin
    present = value.value if inside else []
    indent = " " * (present[0][0].start_mark.column if present else name.start_mark.column + 2)
    new = "".join(f"\n{indent}{n}{row}" for n, row in rows.items() if n not in {own.value for own, _ in present})
    if not present:
        return f"{text[:begin]}:{new}{text[end:]}"
    line = text.find("\n", end)
    text = text[:line] + new + text[line:] if line >= 0 else text + new
    for own, row in reversed(present):
        start, stop = own.end_mark.index, _end_of_value(text, own, row)
        if own.value not in rows:
            start, stop = text.rfind("\n", 0, start), (text + "\n").find("\n", stop)
        text = text[:start] + rows.get(own.value, "") + text[stop:]
    return text


def _end_of_value(text: str, name: Node, value: Node) -> int:
    """Return the index at which a key's value ends; that of a block is the end of its last value, before any comments."""
    if value.start_mark.index == value.end_mark.index:  # nothing
        return text.index(":", name.end_mark.index) + 1
    if value.start_mark.index < name.end_mark.index:  # an alias, whose value is elsewhere
        return re.compile(r"\s*:\s*\*[^\s,\]}]+").match(text, name.end_mark.index).end()  # type: ignore[union-attr]
    if isinstance(value, MappingNode) and value.value and not value.flow_style:
        return _end_of_value(text, *value.value[-1])
    if isinstance(value, SequenceNode) and value.value and not value.flow_style:
        return _end_of_value(text, name, value.value[-1])
    return int(value.end_mark.index)


def _check(patch: Patch, key: str, columns: Mapping[str, Sequence[float]]) -> None:
    """Refuse a change after which the key does not have the columns, or any other key differs."""
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


def _free_backup_name(path: Path) -> Path:
    """Return the first backup name that is not taken: FILE.bak, FILE.bak2, ..."""
    backup = path.with_name(f"{path.name}.bak")
    number = 1
    while backup.exists():
        number += 1
        backup = path.with_name(f"{path.name}.bak{number}")
    return backup
