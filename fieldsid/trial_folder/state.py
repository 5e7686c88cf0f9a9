"""What a folder holds: runs, models and what was made of them, and which of them rest on something that has changed since."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from fieldsid.display import Brief
from fieldsid.errors import ArtifactError, LogError
from fieldsid.logs.reader import reader_of
from fieldsid.logs.run import OF_LIMITS, SIMULATED
from fieldsid.logs.unknown_file import own_kind
from fieldsid.reading import read_yaml
from fieldsid.trial_folder.journal import JOURNAL, Entry, Hashes, made_by, read, relative_to
from fieldsid.trial_folder.make import RUNS

METADATA_KEY = b"fieldsid"
LOG, RUN, MODEL, PLANNED = "log", "run", "model", "planned"
SETTINGS = ("vehicle", "mapping", "user-effect", "effect")
"""Kinds of files that a user writes: they are read, and made of nothing."""


@dataclass(frozen=True, slots=True, repr=False)
class Source(Brief):
    """What a file was made from: its path as named then, where it is now (None: nowhere), and its SHA-256 then."""

    named: str
    path: Path | None
    sha256: str


@dataclass(frozen=True, slots=True, repr=False)
class Item(Brief):
    """One file: its path from the folder, kind, what it was made from, and why it is stale, empty where it is not.

    `body` is the record of a YAML file of this program, empty for all others. `missing` are the inputs that are nowhere.
    `fins` is how far (rad) a run's fins went where its import found them beyond the vehicle's limits, by signal.
    """

    path: str
    kind: str
    sources: tuple[Source, ...] = ()
    stale: str = ""
    missing: tuple[str, ...] = ()
    body: Mapping[str, Any] | None = None
    fins: Mapping[str, float] | None = None


@dataclass(frozen=True, slots=True, repr=False)
class FolderState(Brief):
    """A folder with its files in order, the journal's entries, and how many of its lines could not be read."""

    folder: Path
    items: tuple[Item, ...]
    entries: tuple[Entry, ...]
    broken_lines: int

    def of_kind(self, kind: str) -> tuple[Item, ...]:
        """Return the files of one kind."""
        return tuple(i for i in self.items if i.kind == kind)

    def place(self, item: Item) -> Path:
        """Return where a file is."""
        return self.folder / item.path

    @property
    def models(self) -> tuple[Item, ...]:
        """The models that nothing was extended from, joint ones before those of one run."""
        parents = {str(s.path) for i in self.of_kind(MODEL) for s in _parents(i, self.folder)}
        leaves = [i for i in self.of_kind(MODEL) if str(self.place(i).resolve()) not in parents]
        return tuple(sorted(leaves, key=lambda i: (len(_body(i).get("runs", ())) < 2, i.path)))


def state_of(folder: Path, files: Sequence[Path] | None = None) -> FolderState:
    """Return what a folder holds, or those of its files that are given; what is neither a log nor this program's is left out."""
    entries, broken = read(folder)
    hashes = Hashes(folder, entries)
    wanted = None if files is None else {p.resolve() for p in files}
    found = (i for i in _items(folder) if wanted is None or (folder / i.path).resolve() in wanted)
    items = {i.path: replace(i, kind=SIMULATED) if _is_simulated(i, entries) else i for i in found}
    done: dict[str, Item] = {}
    for path in items:
        _judge(path, items, done, hashes, folder)
    return FolderState(folder, tuple(done[p] for p in items), entries, broken)


def _is_simulated(item: Item, entries: Sequence[Entry]) -> bool:
    """Whether `sysid simulate` wrote a table: one of text does not say so itself, but the journal does."""
    maker = made_by(entries, item.path) if item.kind in (LOG, RUN) else None
    return maker is not None and maker.command[1:2] == ("simulate",)


def _items(folder: Path) -> Iterator[Item]:
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        if not path.is_file() or path.name == JOURNAL or any(p.startswith(".") for p in inside.parts):
            continue
        item = _item(path, inside.as_posix(), folder)
        if item is not None:
            yield item


def _item(path: Path, name: str, folder: Path) -> Item | None:
    if path.name.endswith(".parquet") and (head := _run_head(path)) is not None:
        notes = head.get("notes") or ()
        made = any(note.get("code") == SIMULATED for note in notes)
        told = [n["data"] for n in notes if n.get("code") in OF_LIMITS and "reach_rad" in (n.get("data") or {})]
        fins = {str(d["signal"]): float(d["reach_rad"]) for d in told}
        return Item(name, SIMULATED if made else RUN, _sources(head.get("inputs"), folder), fins=fins)
    kind = own_kind(path) if path.suffix in (".yaml", ".yml") else None
    if kind is not None:
        return _own(path, name, kind, folder)
    if not _is_log(path):
        return None
    if _is_planned(path):
        return Item(name, PLANNED)
    return Item(name, RUN if name.startswith(f"{RUNS}/") else LOG)


def _own(path: Path, name: str, kind: str, folder: Path) -> Item | None:
    try:
        body = read_yaml(path)
    except ArtifactError:  # who uses it says why it cannot be read
        return None
    parent = body.get("parent")
    both = [*(body.get("inputs") or ()), *([parent] if isinstance(parent, dict) else [])]
    return Item(name, kind, () if kind in SETTINGS else _sources(both, folder), body=body)


def _run_head(path: Path) -> Mapping[str, Any] | None:
    try:
        metadata = import_module("pyarrow.parquet").read_schema(path).metadata or {}
        body = json.loads(metadata.get(METADATA_KEY, b"null"))
    except (OSError, ValueError):
        return None
    return body if isinstance(body, dict) and str(body.get("schema", "")).startswith("fieldsid/run/") else None


def _is_log(path: Path) -> bool:
    if path.suffix in (".yaml", ".yml", ".md", ".png", ".svg", ".pdf", ".html", ".json", ".py"):
        return False
    try:
        reader_of(path)
    except LogError:
        return False
    return True


def _is_planned(path: Path) -> bool:
    """Whether a table is a fin to fly, which `sysid plan` wrote beside its plan: nothing was measured."""
    plan = path.with_name("plan.yaml")
    return path.name.startswith("leg") and plan.is_file() and own_kind(plan) == "plan"


def _sources(named: Any, folder: Path) -> tuple[Source, ...]:
    entries = [e for e in named or () if isinstance(e, dict) and "path" in e]
    return tuple(Source(str(e["path"]), _found(str(e["path"]), folder), str(e.get("sha256", ""))) for e in entries)


def _found(named: str, folder: Path) -> Path | None:
    """Return where a file is that was named from the folder, from the one above it, or from where the program runs."""
    # the folder above the working folder, "." as a rule, is none of its path
    places = (folder / named, folder.resolve().parent / named, Path(named))
    return next((p.resolve() for p in places if p.exists()), None)


def _parents(item: Item, folder: Path) -> tuple[Source, ...]:
    parent = _body(item).get("parent")
    return _sources([parent] if isinstance(parent, dict) else [], folder)


def _body(item: Item) -> Mapping[str, Any]:
    return item.body or {}


def _judge(path: str, items: Mapping[str, Item], done: dict[str, Item], hashes: Hashes, folder: Path) -> Item:
    """Say of a file why it is stale: an input has changed since, or rests on one that has."""
    if path in done:
        return done[path]
    item = done[path] = items[path]  # a file that names itself ends here
    missing = tuple(s.named for s in item.sources if s.path is None)
    because = ""
    for source in item.sources:
        if source.path is None or because:
            continue
        name = relative_to(source.path, folder)
        if source.sha256 and hashes.stamp(source.path).sha256 != source.sha256:
            because = f"{name} has changed"
        elif name in items and _judge(name, items, done, hashes, folder).stale:
            because = f"{name} is stale"
    done[path] = replace(item, stale=because, missing=missing)
    return done[path]
