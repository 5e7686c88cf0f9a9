"""Read text, YAML and JSON from untrusted files: up to stated limits, each with a separate error.

All such files are read here. The result has nested mappings with text keys, lists, text, numbers of 64 bits, booleans and null;
everything else that YAML allows (tags, dates, files that contain themselves) is refused or stays text.
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Callable, Mapping
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from shlex import quote
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.constructor import SafeConstructor
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode

from fieldsid.errors import ArtifactError, shortened
from fieldsid.records.check import ShapeError, check
from fieldsid.records.kinds import ANY, KINDS
from fieldsid.registry import similar

LARGEST_TEXT = 4 << 20
"""Most bytes of a text file: a hundred times the largest that this program writes, the state of a live estimate."""
MOST_VALUES = 30_000
"""Most keys and values of a YAML file, where those of an alias count at each use: ten times those of a law of many speeds."""
DEEPEST = 60
"""Most levels of nested mappings and lists."""
LARGEST_INTEGER = 2**64
"""Integers must be smaller, so that they fit into arrays."""
_TAG = "tag:yaml.org,2002:"
_KNOWN = frozenset(_TAG + t for t in ("map", "seq", "str", "int", "float", "bool", "null", "merge"))
_AS_TEXT = frozenset(_TAG + t for t in ("timestamp", "value"))
"""YAML types that are read as text: dates, and the equals sign."""
_SURROGATES = range(0xD800, 0xE000)


class LimitError(ValueError):
    """A limit that a text exceeds; the message says which."""


def read_text(path: Path) -> str:
    """Read a text file; raises ArtifactError where it cannot be read, is not a plain file, is too large or is not text."""
    try:
        return read_bytes(path).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        raise ArtifactError(
            f"`{path}` is not YAML, nor any text", found=str(error), hint="give a file with `key: value` lines"
        ) from error


def read_bytes(path: Path) -> bytes:
    """Read the bytes of a text file without decoding; raises ArtifactError as `read_text` does."""
    try:
        with open(path, "rb", opener=_without_waiting) as stream:
            if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
                raise ArtifactError(
                    f"`{path}` is no plain file", found="a pipe or a device", hint="write what it gives to a file, and name that"
                )
            raw = stream.read(LARGEST_TEXT + 1)
    except IsADirectoryError as error:
        names = sorted(p.name for p in path.iterdir())
        found = f"it holds {', '.join(names[:3])}{' ...' if len(names) > 3 else ''}" if names else "it is empty"
        raise ArtifactError(f"`{path}` is a folder, where a file is needed", found=found, hint="name a file in it") from error
    except OSError as error:
        raise ArtifactError(
            f"`{path}` cannot be read: {error.strerror}",
            found=f"in `{path.parent}`",
            hint=near_files(path) if isinstance(error, FileNotFoundError) else "check its permissions",
        ) from error
    if len(raw) > LARGEST_TEXT:
        found = f"{path.stat().st_size} bytes, more than {LARGEST_TEXT}"
        raise ArtifactError(f"`{path}` is too large for a file of this kind", found=found, hint="check that this file is meant")
    return raw


def _without_waiting(path: str, flags: int) -> int:
    """Open a file without waiting, even if it is a pipe without a writer."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_yaml(path: Path) -> dict[str, Any]:
    """Read a YAML mapping; raises ArtifactError where it cannot be read, exceeds a limit or is not a mapping."""
    return yaml_mapping(read_text(path), path)


def yaml_mapping(text: str, path: Path) -> dict[str, Any]:
    """Return the mapping of a YAML text; raises ArtifactError naming the file it came from."""
    body = _with_file_in_error(path, lambda: deepcopy(_parsed(text)))
    if not isinstance(body, dict):
        raise ArtifactError(f"`{path}` holds no keys with values", found=_shape_of(body), hint="write `key: value` lines")
    return body


def load_record(path: Path, kind: str) -> dict[str, Any]:
    """Read a record back and check that it is one of `kind` (`fieldsid/model` for `fieldsid/model/1`).

    Raises ArtifactError where the file cannot be read, is not YAML, is another kind of record, or lacks the shape of its kind.
    """
    body = read_yaml(path)
    schema = body.get("schema")
    if not isinstance(schema, str) or not schema.startswith(f"{kind}/"):
        made_by = KINDS.get(kind, ANY).made_by
        raise ArtifactError(
            f"`{path}` is not a {kind} file",
            found=f"schema: {shortened(schema)}",
            hint=f"`{made_by}` makes one" if made_by else f"give a file with a line `schema: {kind}/1`",
        )
    if schema != f"{kind}/1":
        number = schema.rpartition("/")[2]
        if number.isdecimal() and int(number[:9]) > 1:
            raise ArtifactError(f"`{path}` has a newer schema than this version reads", found=schema, hint="update fieldsid")
        raise ArtifactError(f"`{path}` has a schema that there is not", found=schema, hint=f"such a file has `schema: {kind}/1`")
    check_kind(body, kind, path)
    return body


def check_kind(body: Mapping[str, Any], kind: str, path: Path) -> None:
    """Raise ArtifactError where a record does not have the shape of its kind, with the key and what is wrong."""
    shape, name, again, _ = KINDS.get(kind, ANY)
    try:
        check(body, shape)
    except ShapeError as error:
        raise ArtifactError(f"`{path}` is not a complete {name}", found=str(error), hint=again) from error


def read_json(text: str | bytes) -> Any:
    """Return the value of a JSON text; raises ValueError where it is not JSON or exceeds a limit."""
    if len(text) > LARGEST_TEXT:
        raise LimitError(f"{len(text)} bytes, more than {LARGEST_TEXT}")
    try:
        body = json.loads(text, parse_int=_integer)
    except RecursionError as error:
        raise LimitError("brackets without end") from error
    if (b"\\u" if isinstance(text, bytes) else "\\u") in text:  # type: ignore[operator]
        json.dumps(body, ensure_ascii=False).encode()  # raises UnicodeEncodeError, a ValueError, for a lone surrogate
    return body


def _integer(digits: str) -> int:
    if len(digits) > len(str(LARGEST_INTEGER)) or abs(number := int(digits)) >= LARGEST_INTEGER:
        raise LimitError(f"a number of {len(digits)} digits, beyond 64 bits")
    return number


def near_files(path: Path) -> str:
    """Return a hint with a file of a similar name in the same folder."""
    names = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() and os.access(path.parent, os.R_OK) else []
    close = similar(path.name, names)
    return f"did you mean `{quote(str(path.parent / close[0]))}`?" if close else "check the path"


def _with_file_in_error(path: Path, parse: Callable[[], object]) -> object:
    try:
        return parse()
    except YAMLError as error:
        mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None)
        found = str(error).strip() if mark is None else f"line {mark.line + 1}, column {mark.column + 1}: {problem}"
        raise ArtifactError(f"`{path}` is not valid YAML", found=found, hint="mend the line named above") from error
    except LimitError as error:
        hint = "take out what the line above tells of: no file of this program needs it"
        raise ArtifactError(f"`{path}` passes a limit of the YAML that is read", found=str(error), hint=hint) from error
    except (ValueError, OverflowError, RecursionError) as error:  # an impossible character, endless brackets
        found = f"{type(error).__name__}: {error}"
        raise ArtifactError(f"`{path}` holds a value that YAML cannot read", found=found, hint="put text in quotes") from error


@lru_cache(maxsize=32)
def _parsed(text: str) -> object:
    """Return the value of a YAML text, cached: a command reads the file of a model repeatedly, and parsing takes 25 ms."""
    yaml = YAML(typ="safe", pure=True)  # the compiled parser has no limit on nested brackets
    yaml.Composer, yaml.Constructor = _Composer, _Constructor
    return yaml.load(text)


class _Composer(Composer):
    """Composes nodes up to the limits on their number and depth."""

    values = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Return the next node; raises LimitError."""
        self.values += 1
        line = self.parser.peek_event().start_mark.line + 1
        if self.values > MOST_VALUES:
            raise LimitError(f"line {line}: more than {MOST_VALUES} keys and values")
        if self.depth > DEEPEST:
            raise LimitError(f"line {line}: mappings and lists inside one another more than {DEEPEST} deep")
        return super().compose_node(parent, index)


class _Constructor(SafeConstructor):
    """Constructs plain values after all nodes have been checked."""

    def construct_document(self, node: Any) -> Any:
        """Return the value of a complete file; raises LimitError."""
        if _values_of(node, {}) > MOST_VALUES:
            raise LimitError(f"aliases (`*name`) that stand for more than {MOST_VALUES} keys and values in all")
        return super().construct_document(node)

    def construct_yaml_int(self, node: Any) -> int:
        """Return an integer; raises LimitError for one that 64 bits do not hold."""
        if len(node.value) <= 2 + 64 and abs(number := int(super().construct_yaml_int(node))) < LARGEST_INTEGER:
            return number
        raise LimitError(f"line {node.start_mark.line + 1}: a number of {len(node.value)} digits, beyond 64 bits")


_Constructor.add_constructor(f"{_TAG}int", _Constructor.construct_yaml_int)


def _values_of(node: Node, known: dict[int, int]) -> int:
    """Return the number of values in a node, and check that each has an allowed type; raises LimitError.

    The target of an alias is one node, which is checked once and counted at each use. A node met again while it is being counted
    contains itself.
    """
    if id(node) in known:
        if not known[id(node)]:
            raise LimitError(f"line {node.start_mark.line + 1}: a value that holds itself")
        return known[id(node)]
    known[id(node)] = 0
    if isinstance(node, ScalarNode):
        _check_scalar(node)
        inner: list[Node] = []
    elif isinstance(node, MappingNode):
        inner = [part for pair in node.value for part in pair]
        for key, _ in node.value:
            _make_text(key)
    else:
        inner = list(node.value)
    _check_tag(node)
    known[id(node)] = 1 + sum(_values_of(part, known) for part in inner)
    return known[id(node)]


def _make_text(key: Node) -> None:
    """Turn a key into text, also where it is a number or a date; raises LimitError for a key that is not a scalar."""
    if not isinstance(key, ScalarNode):
        raise LimitError(f"line {key.start_mark.line + 1}: a key that is no word")
    if key.tag != f"{_TAG}merge":
        _check_tag(key)
        key.tag = f"{_TAG}str"


def _check_scalar(node: ScalarNode) -> None:
    if node.tag in _AS_TEXT:
        node.tag = f"{_TAG}str"
    if any(ord(letter) in _SURROGATES for letter in node.value):
        raise LimitError(f"line {node.start_mark.line + 1}: half a letter, which no text has")


def _check_tag(node: Node) -> None:
    if node.tag not in _KNOWN | _AS_TEXT:
        tag = str(node.tag).removeprefix(_TAG)
        raise LimitError(f"line {node.start_mark.line + 1}: a value of a type of its own, `{shortened(tag)}`")


def _shape_of(body: object) -> str:
    return "nothing" if body is None else "a list" if isinstance(body, list) else f"the text {shortened(body)}"
