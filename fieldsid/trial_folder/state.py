"""The state of a trial folder: runs, models and the files made from them, and which of them have inputs that changed since."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from itertools import takewhile
from pathlib import Path
from typing import Annotated, Any

from fieldsid.display import Brief
from fieldsid.errors import ArtifactError, FieldsidError, LogError
from fieldsid.logs.load import load_run
from fieldsid.logs.reader import reader_of
from fieldsid.logs.readers.several_tables import holds_one_run
from fieldsid.logs.run import OF_LIMITS, SIMULATED, Run
from fieldsid.logs.unknown_file import own_kind
from fieldsid.records.keys import Key, Words
from fieldsid.records.named_inputs import first_allowed
from fieldsid.records.reading import check_kind, read_json, read_yaml
from fieldsid.trial_folder.journal import JOURNAL, Entry, Hashes, made_by, read, relative_to
from fieldsid.trial_folder.make import LOGS, MODELS, RUNS

METADATA_KEY = b"fieldsid"
LOG, RUN, MODEL, PLANNED = "log", "run", "model", "planned"
DONE = (0, 1)
"""Exit codes of a command that gave a result."""
SETTINGS = ("vehicle", "mapping", "user-effect", "effect")
"""Kinds of files that a user writes; they have no inputs."""


@dataclass(frozen=True, slots=True, repr=False)
class Source(Brief):
    """An input of a file: its path as named then, its path now (None where it is missing), and its SHA-256 then."""

    named: Annotated[str, Key("The file as it was named then.", "path")]
    path: Path | None
    sha256: Annotated[str, Key("Its hash then.")]


@dataclass(frozen=True, slots=True, repr=False)
class Item(Brief):
    """One file: its path from the folder, kind, inputs, and why it is stale (empty where it is not).

    `body` is the record of a YAML file of this program, empty for all others. `missing` are the inputs that were not found.
    `fins` are the largest fin angles (rad) by signal, for fins that went beyond the vehicle's limits when the run was imported.
    """

    path: Annotated[str, Key("Its path from the folder.")]
    kind: Annotated[str, Key("What it is: log, run, model, fit, schedule, ...")]
    sources: Annotated[tuple[Source, ...], Key("What it was made from, as it says itself.", "made_from")] = ()
    stale: Annotated[Words, Key("Why it does not hold any more; null where it does.")] = ""
    missing: Annotated[tuple[str, ...], Key("What it was made from and is not there any more.")] = ()
    body: Mapping[str, Any] = field(default_factory=dict)
    fins: Mapping[str, float] = field(default_factory=dict)

    @property
    def axis(self) -> str | None:
        """The plane of a record; None where it has none."""
        return self.body.get("axis")

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects of a record."""
        return tuple(map(str, self.body.get("effects", ())))

    @property
    def runs(self) -> tuple[str, ...]:
        """The names of the runs to which a model was fitted."""
        return tuple(map(str, self.body.get("runs", ())))

    @property
    def standing(self) -> str:
        """The reason why the file is stale, or its missing inputs; empty where neither."""
        return f"stale: {self.stale}" if self.stale else f"not there: {', '.join(self.missing)}" if self.missing else ""


@dataclass(frozen=True, slots=True, repr=False)
class FolderState(Brief):
    """A folder with its files in order, the journal's entries, and how many of its lines could not be read.

    `unreadable` says why a file of this program cannot be read, for each that is not among the items. `sides` are subfolders that
    are trials themselves, as before and after a swap; their files do not belong to this folder.
    """

    folder: Annotated[Path, Key("The folder.")]
    items: Annotated[tuple[Item, ...], Key("The files that the program knows.", "files")]
    entries: Annotated[tuple[Entry, ...], Key("The commands that were run in it, the oldest first.", "journal")]
    broken_lines: Annotated[
        int, Key("Lines of the journal that are none, as a power cut leaves them.", "unreadable_journal_lines")
    ]
    unreadable: tuple[str, ...] = ()
    sides: tuple[str, ...] = ()

    @property
    def stale(self) -> Annotated[tuple[str, ...], Key()]:
        """Those that rest on something that has changed since."""
        return tuple(i.path for i in self.items if i.stale)

    def of_kind(self, kind: str) -> tuple[Item, ...]:
        """Return the files of one kind."""
        return tuple(i for i in self.items if i.kind == kind)

    def newest(self, items: Iterable[Item]) -> Item | None:
        """Return the item that was written last, None where there are none."""
        return max(items, key=lambda i: (self.place(i).stat().st_mtime_ns, i.path), default=None)

    def done(self, name: str) -> tuple[Entry, ...]:
        """Return the journal entries of a command that gave a result, the oldest first."""
        return tuple(e for e in self.entries if e.name == name and e.exit in DONE)

    def place(self, item: Item) -> Path:
        """Return the path of a file."""
        return self.folder / item.path

    def parents(self, item: Item) -> tuple[Source, ...]:
        """Return the parent of an extended model; empty for other files."""
        return _sources(_named_files(item.body, "parent"), self.folder)

    def mapping_of(self, log: Path) -> Path | None:
        """Return the mapping with which a model of a log was made; None where it names none."""
        for item in self.of_kind(MODEL):
            sources = _sources(_named_files(item.body, "mapping"), self.folder)
            if sources and any(s.path == log.resolve() for s in item.sources):
                return sources[0].path
        return None

    def readable_runs(self) -> Iterator[tuple[Item, Run]]:
        """Yield each run that can be read: a command that uses another reports what is wrong with it."""
        for item in self.of_kind(RUN):
            place = self.place(item)
            try:
                run = load_run(place, self.mapping_of(place), recognise=True)
            except FieldsidError:
                continue
            yield item, run

    @property
    def models(self) -> tuple[Item, ...]:
        """The models that have not been extended, joint ones before those of one run."""
        parents = {str(s.path) for i in self.of_kind(MODEL) for s in self.parents(i)}
        leaves = [i for i in self.of_kind(MODEL) if str(self.place(i).resolve()) not in parents]
        return tuple(sorted(leaves, key=lambda i: (len(i.runs) < 2, i.path)))


def state_of(folder: Path, files: Sequence[Path] | None = None) -> FolderState:
    """Return the state of a folder, or of the given files in it; only logs and files of this program are included."""
    entries, broken = read(folder)
    hashes = Hashes(folder, entries)
    wanted = None if files is None else {p.resolve() for p in files}
    unreadable: list[str] = []
    sides = _trials_inside(folder)
    found = (i for i in _items(folder, sides, unreadable) if wanted is None or (folder / i.path).resolve() in wanted)
    items = {i.path: replace(i, kind=SIMULATED) if _is_simulated(i, entries) else i for i in found}
    done: dict[str, Item] = {}
    for path in items:
        _with_staleness(path, items, done, hashes, folder)
    return FolderState(folder, tuple(done[p] for p in items), entries, broken, tuple(unreadable), sides)


def _trials_inside(folder: Path) -> tuple[str, ...]:
    """Return the subfolders that are trials themselves, the one with the oldest files first."""
    names = (JOURNAL, LOGS, RUNS, MODELS)
    # os.path returns False for a folder that may not be read, and does not raise
    found = [p for p in folder.iterdir() if not p.is_symlink() and any(os.path.exists(p / n) for n in names)]  # noqa: PTH110
    return tuple(p.name for p in sorted(found, key=lambda p: (min(f.lstat().st_mtime_ns for f in p.iterdir()), p.name)))


def _is_simulated(item: Item, entries: Sequence[Entry]) -> bool:
    """Whether `sysid simulate` wrote a table: a text file does not record it, but the journal does."""
    maker = made_by(entries, item.path) if item.kind in (LOG, RUN) else None
    return maker is not None and maker.command[1:2] == ("simulate",)


def _items(folder: Path, sides: Sequence[str], unreadable: list[str]) -> Iterator[Item]:
    joined: set[Path] = set()
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        if inside.parts[0] in sides or path.name == JOURNAL or any(p.startswith(".") for p in inside.parts):
            continue
        if path.parent in joined or _is_one_run(path, inside):
            joined.add(path)
            if path.parent not in joined:
                yield Item(inside.as_posix(), LOG)
            continue
        if not path.is_file():
            continue
        try:
            item = _item(path, inside.as_posix(), folder)
        except ArtifactError as error:
            unreadable.append(f"{inside.as_posix()}: {error.found}")
            continue
        if item is not None:
            yield item


def _is_one_run(path: Path, inside: Path) -> bool:
    """Whether a folder below that of the logs has the tables of one run, which are one log."""
    try:
        return path.is_dir() and inside.parts[0] == LOGS and len(inside.parts) > 1 and holds_one_run(path)
    except (LogError, OSError):  # the command that reads a table of it reports what is wrong
        return False


def _item(path: Path, name: str, folder: Path) -> Item | None:
    if path.name.endswith(".parquet") and (head := run_head(path)) is not None:
        made = any(note["code"] == SIMULATED for note in head["notes"])
        limit_notes = [n["data"] for n in head["notes"] if n["code"] in OF_LIMITS and "reach_rad" in n["data"]]
        fins = {str(d.get("signal")): float(d["reach_rad"]) for d in limit_notes}
        return Item(name, SIMULATED if made else RUN, _sources(head.get("inputs") or (), folder), fins=fins)
    kind = own_kind(path) if path.suffix in (".yaml", ".yml") else None
    if kind is not None:
        return _own(path, name, kind, folder)
    if not _is_log(path):
        return None
    if _is_planned(path, folder):
        return Item(name, PLANNED)
    return Item(name, RUN if name.startswith(f"{RUNS}/") else LOG)


def _own(path: Path, name: str, kind: str, folder: Path) -> Item:
    """Return the item of a file of this program; raises ArtifactError where it cannot be read or lacks the shape of its kind."""
    if kind in SETTINGS:  # the command that uses it reports what is wrong
        return Item(name, kind)
    body = read_yaml(path)
    check_kind(body, f"fieldsid/{kind}", path)
    named = [*(body.get("inputs") or ()), *_named_files(body, "mapping"), *_named_files(body, "parent")]
    return Item(name, kind, _sources(named, folder), body=body)


def _named_files(body: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    return [] if body.get(key) is None else [body[key]]


def run_head(path: Path) -> Mapping[str, Any] | None:
    """Return the metadata of a run file, None for another table; raises ArtifactError where the metadata are damaged."""
    try:
        metadata = import_module("pyarrow.parquet").read_schema(path).metadata or {}
        body = read_json(metadata.get(METADATA_KEY, b"null"))
    except (OSError, ValueError):
        return None
    if not isinstance(body, dict) or not str(body.get("schema", "")).startswith("fieldsid/run/"):
        return None
    check_kind(body, "fieldsid/run", path)
    return body


def _is_log(path: Path) -> bool:
    if path.suffix in (".yaml", ".yml", ".md", ".png", ".svg", ".pdf", ".html", ".json", ".py"):
        return False
    try:
        reader_of(path)
    except LogError:
        return False
    return True


def _is_planned(path: Path, folder: Path) -> bool:
    """Whether a table or a bag is a planned fin command that `sysid plan` wrote next to its plan, and not a log."""
    inside = takewhile(lambda p: p != folder, (path, *path.parents))
    plans = (p.with_name("plan.yaml") for p in inside if p.name.startswith("leg"))
    return any(plan.is_file() and own_kind(plan) == "plan" for plan in plans)


def _sources(named: Sequence[Mapping[str, Any]], folder: Path) -> tuple[Source, ...]:
    return tuple(Source(e["path"], _path_of_named(e["path"], folder), e["sha256"]) for e in named)


def _path_of_named(named: str, folder: Path) -> Path | None:
    """Return the path of a file that was named relative to the folder, to its parent folder, or to the working folder."""
    # resolved first, as the parent of "." is not its path's parent
    there = first_allowed((folder / named, folder.resolve().parent / named, Path(named)), folder.resolve())
    return None if there is None else there.resolve()


def _name_of_missing(source: Source) -> str:
    """Return the name of an input that was not found."""
    return source.named if source.path is None else f"{source.named} (too large to be hashed)"


def _with_staleness(path: str, items: Mapping[str, Item], done: dict[str, Item], hashes: Hashes, folder: Path) -> Item:
    """Return the item with the reason why it is stale: an input has changed since, or is stale itself."""
    if path in done:
        return done[path]
    item = done[path] = items[path]  # set before the recursion, which thus ends at a file that names itself
    now = {s: hashes.of_named(s.path) for s in item.sources if s.path is not None and s.sha256}
    missing = tuple(_name_of_missing(s) for s in item.sources if s.path is None or (s in now and now[s] is None))
    because = ""
    for source in item.sources:
        if source.path is None or because:
            continue
        name = relative_to(source.path, folder)
        if now.get(source) not in (None, source.sha256):
            because = f"{name} has changed"
        elif name in items and _with_staleness(name, items, done, hashes, folder).stale:
            because = f"{name} is stale"
    done[path] = replace(item, stale=because, missing=missing)
    return done[path]
