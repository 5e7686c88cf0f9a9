"""Headlines of what becomes of a log: inspect, import."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.cli.headlines.words import named
from fieldsid.page import counted
from fieldsid.trial_folder.journal import is_trial
from fieldsid.trial_folder.make import LOGS, MAPPING

if TYPE_CHECKING:
    from fieldsid.results.logs import Import, Inspected

PROOF = "evidence"
"""Code of a finding that says why a column was taken for a signal: nothing is wrong there."""


def of_inspection(told: Inspected, mapping: Path | None) -> Headline:
    """Return what a log holds, and how it becomes a run."""
    log, findings = " + ".join([told.path, *told.joined]), sum(f.code != PROOF for f in told.findings)
    said = counted(findings, "finding") if findings else "nothing found that would spoil an identification"
    if told.signals:
        says = f"{log} holds {counted(len(told.signals), 'signal')} for {told.span}; {said}"
    else:
        says = f"{log} is no run yet: {'see the findings' if told.problem else 'none of its names says what its numbers are'}"
    proposed = f"`{mapping}`" if mapping else "a proposed mapping: check units and signs"
    how = proposed if told.mapping_needed else "its own names"
    return Headline(says, f"{told.format}, {counted(len(told.channels), 'channel')}, by {how}", _after(told, mapping))


def _after(told: Inspected, mapping: Path | None) -> str:
    known = told.mapping_file or mapping
    if told.mapping_needed and known is None:
        return typed_with("--write-mapping", MAPPING, *(("--force",) if Path(MAPPING).exists() else ()))
    if not told.signals:  # an import is refused until somebody has said what the columns are
        return pasted("guide", "trial")
    if _is_taken(Path(told.path), known) and not told.import_options and not told.joined:
        return pasted("import")
    files = [*(["--join"] if told.joined else []), told.path, *told.joined]
    return pasted("import", *files, *(("--mapping", known) if known else ()), *told.import_options, "-o", "runs/")


def _is_taken(log: Path, mapping: str | Path | None) -> bool:
    """Whether an import here takes a log, among others, and its mapping from the trial folder."""
    is_here = is_trial(Path()) and log.resolve().parent == Path(LOGS).resolve()
    return is_here and (mapping is None or Path(mapping).resolve() == Path(MAPPING).resolve())


def of_import(told: Import, axis: str) -> Headline:
    """Return how many runs there are now, and the first fit of them, in the plane that they excite."""
    runs, there = told.runs, told.already_imported
    if not runs and there:
        return Headline(f"already imported: {counted(len(there), 'log')}, as they are", named(there), pasted("status"))
    files, noted = [r.file for r in runs], sum(len(r.warnings) for r in runs)
    joint = ("--joint",) if len(files) > 1 else ()
    says = f"{counted(len(runs), 'run')}, {sum(r.duration_s for r in runs):.0f} s, "
    logs = list(dict.fromkeys(Path(r.log).resolve().name for r in runs if r.log is not None))
    return Headline(
        says + (counted(noted, "note") if noted else "nothing to note"),
        f"{named(logs) or 'standard input'}: SI and radians, one clock, gaps left as gaps",
        pasted("identify", files, "--axis", axis, *joint, "-o", "models/") if files else "",
    )
