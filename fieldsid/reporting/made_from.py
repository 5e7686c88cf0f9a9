"""The table of files and their inputs: each with the start of its SHA-256, many inputs of one folder in one line."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import PurePosixPath

from fieldsid.page import Block
from fieldsid.trial_folder.journal import Hashes, made_by, relative_to
from fieldsid.trial_folder.patterns import FEW
from fieldsid.trial_folder.state import LOG, RUN, FolderState, Item, Source

NOT_HASHED = "too large"
HASH = 8
"""Characters of a SHA-256 that are shown."""


def lineage(state: FolderState) -> Block:
    """Return a table with a row for each file; the log of a run is in the row of that run."""
    hashes = Hashes(state.folder, state.entries)
    used = {_name(s, state) for run in state.of_kind(RUN) for s in run.sources}
    items = [i for i in state.items if not (i.kind == LOG and i.path in used)]
    now = {i.path: hashes.of_named(state.place(i)) or NOT_HASHED for i in items}
    heads = ("file", "SHA-256", "what", "made from", "by", "")
    return Block("Files, with the start of their SHA-256", tuple(_row(i, state, now) for i in items), heads, left=len(heads))


def _row(item: Item, state: FolderState, now: Mapping[str, str]) -> tuple[str, ...]:
    maker = made_by(state.entries, item.path)
    named = [(s, _name(s, state)) for s in item.sources]
    with_hash = [f"{name} ({s.sha256[:HASH]})" for s, name in named if s.sha256 and now.get(name) != s.sha256]
    unchanged = [name for s, name in named if not s.sha256 or now.get(name) == s.sha256]
    return (
        item.path,
        now[item.path][:HASH],
        item.kind,
        "; ".join([*_grouped_names(unchanged, now), *with_hash]),
        "" if maker is None else maker.name,
        item.standing,
    )


def _name(source: Source, state: FolderState) -> str:
    return source.named if source.path is None else relative_to(source.path, state.folder)


def _grouped_names(names: Iterable[str], rows: Collection[str]) -> list[str]:
    """Return names; more than a few of one folder and suffix are combined, by their pattern or as all of the table's."""
    kinds: dict[tuple[str, str], list[str]] = {}
    for name in dict.fromkeys(names):
        path = PurePosixPath(name)
        kinds.setdefault((path.parent.as_posix(), path.suffix), []).append(name)
    parts = []
    for (folder, suffix), group in kinds.items():
        there = [r for r in rows if PurePosixPath(r).parent.as_posix() == folder and PurePosixPath(r).suffix == suffix]
        left_out = [PurePosixPath(r).stem for r in there if r not in group]
        if len(group) <= FEW:
            parts += group
        elif len(left_out) <= FEW:
            but = f", without {', '.join(left_out)}" if left_out else ""
            parts.append(f"{folder}/*{suffix} ({len(group)}{but})")
        else:
            parts.append(f"{folder}/: {', '.join(PurePosixPath(n).stem for n in group)}")
    return parts
