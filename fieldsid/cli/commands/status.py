"""sysid status: what a trial folder holds, what follows from what, what is stale, what comes next."""

from __future__ import annotations

import shlex
from collections import Counter
from pathlib import Path

from fieldsid.cli.console import Body, emit
from fieldsid.cli.headlines.trial import headline_of_status
from fieldsid.cli.options import argument
from fieldsid.logs.run import Note
from fieldsid.logs.several.run_names import stem_of
from fieldsid.page import Block, Page, Whole, counted, paragraph
from fieldsid.trial_folder.state import DONE, FolderState, Item, state_of

NAMES = {
    "vehicle": ("vehicle", ""), "mapping": ("mapping", ""), "plan": ("plan", ""), "log": ("log", ""), "run": ("run", ""),
    "model": ("model", ""), "diagnosis": ("diagnosis", "diagnoses"), "fit": ("file of laws", "files of laws"),
    "turn-radius": ("turning radius", "turning radii"), "schedule": ("file of gains", "files of gains"),
    "simulated": ("simulated run", ""),
}  # fmt: skip
"""Kinds of files, in the order of the list, and the name of each with an irregular plural."""
MOST_SOURCES = 2
"""Number of source files up to which each is named; of more only the first is."""
WIDEST_NAME = 40
"""Number of characters up to which a file's name stays on one line, however wide the other columns are."""
LAST = 3
"""Number of journal lines that are listed."""


def command(
    folder: Path = argument("FOLDER", "The trial folder; the one it is run in if not given.", Path()),
) -> Body:
    """Say what a folder holds, what was made from what, which files are stale, and what to do next.

    A file is stale where something that it was made from has changed since, by its hash, or is stale itself. Any folder will do;
    one that `sysid init` made has a journal too, by which the command that makes a stale file again is known.

    Example: sysid status
    """
    from fieldsid.errors import UsageError
    from fieldsid.results.trial import NextStep, Status
    from fieldsid.trial_folder.fin_limits import contradicted_limits
    from fieldsid.trial_folder.next_step import next_step

    if not folder.is_dir():
        raise UsageError(
            f"`{folder}` is no folder", found="a file" if folder.exists() else "nothing there", hint="`sysid init NAME`"
        )
    state = state_of(folder)
    broken = f"{state.broken_lines} lines of the journal cannot be read"
    notes = [*([Note("journal", broken, {})] if state.broken_lines else []), *contradicted_limits(state)]
    notes += [Note("unreadable", said, {}) for said in state.unreadable]
    why, line = next_step(state)
    if line and folder.resolve() != Path.cwd():
        line = f"cd {shlex.quote(str(folder))} && {line}"
    result = Status(state, _verdict(state), tuple(notes), NextStep(why, line))
    return emit(result, render=_page(state), headline=headline_of_status(result), notes=notes)


def _verdict(state: FolderState) -> str:
    counts = Counter(i.kind for i in state.items)
    contents = (
        ", ".join(counted(counts[k], *NAMES[k]) for k in NAMES if counts[k] and k not in ("vehicle", "mapping")) or "nothing yet"
    )
    name, stale = state.folder.resolve().name, len(state.stale)
    return f"{name}: {contents}; " + (f"{stale} stale" if stale else "nothing is stale")


def _page(state: FolderState) -> Page:
    used = {s.path for i in state.of_kind("run") for s in i.sources}  # a log that was imported is not listed
    listed = [i for i in state.items if i.kind in NAMES and not (i.kind == "log" and state.place(i).resolve() in used)]
    shown = sorted(listed, key=lambda i: (list(NAMES).index(i.kind), i.path))
    journal_lines = []
    for e in [e for e in state.entries if e.verdict][-LAST:]:
        done = "" if e.exit in DONE else "failed: "
        journal_lines.append(f"{e.when}  sysid {e.name}: {done}{e.verdict}")
    files = Block("", tuple(map(_row, shown)), ("file", "what", "made from", ""), left=4, kept=WIDEST_NAME)
    return Page("", blocks=(files, *paragraph(journal_lines, Whole)))


def _row(item: Item) -> tuple[str, ...]:
    names = [stem_of(Path(s.named)) for s in item.sources]
    said = ", ".join(names) if len(names) <= MOST_SOURCES else f"{names[0]} and {len(names) - 1} more"
    what = NAMES[item.kind][0].removeprefix("file of ")
    effects = len(item.effects) if item.kind == "model" else 0
    kind = f"{what}, {counted(effects, 'effect')}" if effects else what
    return item.path, kind, said.replace("+", " +"), item.standing  # a blank lets a line end between effects
