"""Headlines from log to run: inspect, import."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.cli.headlines.words import first_names
from fieldsid.page import counted
from fieldsid.trial_folder.journal import is_trial
from fieldsid.trial_folder.make import LOGS, MAPPING

if TYPE_CHECKING:
    from fieldsid.results.logs import Import, Inspected

PROOF = "evidence"
"""Code of a finding that only says why a column was taken for a signal: it is no fault of the log."""


def headline_of_inspection(result: Inspected, mapping: Path | None) -> Headline:
    """Return what a log contains, what would spoil an identification, and how it becomes a run."""
    log, findings = " + ".join([result.path, *result.joined]), sum(f.code != PROOF for f in result.findings)
    faults = counted(findings, "finding") if findings else "nothing found that would spoil an identification"
    if result.signals:
        says = f"{log} holds {counted(len(result.signals), 'signal')} for {result.span}; {faults}"
    else:
        says = f"{log} is no run yet: {'see the findings' if result.problem else 'none of its names says what its numbers are'}"
    proposed = f"`{mapping}`" if mapping else "a proposed mapping: check units and signs"
    how = proposed if result.mapping_needed else "its own names"
    return Headline(
        says, f"{result.format}, {counted(len(result.channels), 'channel')}, by {how}", _next_command(result, mapping)
    )


def _next_command(result: Inspected, mapping: Path | None) -> str:
    """Return the next command: write the mapping, read the guide, or import the log."""
    known = result.mapping_file or mapping
    if result.mapping_needed and known is None:
        return typed_with("--write-mapping", MAPPING, *(("--force",) if Path(MAPPING).exists() else ()))
    if not result.signals:  # an import is refused until a mapping says what the columns are
        return pasted("guide", "trial")
    if _is_in_trial(Path(result.path), known) and not result.import_options and not result.joined:
        return pasted("import")
    files = [*(["--join"] if result.joined else []), result.path, *result.joined]
    return pasted("import", *files, *(("--mapping", known) if known else ()), *result.import_options, "-o", "runs/")


def _is_in_trial(log: Path, mapping: str | Path | None) -> bool:
    """Whether a bare `sysid import` here would import this log, among others, with this mapping."""
    is_here = is_trial(Path()) and log.resolve().parent == Path(LOGS).resolve()
    return is_here and (mapping is None or Path(mapping).resolve() == Path(MAPPING).resolve())


def headline_of_import(result: Import, axis: str) -> Headline:
    """Return how many runs were made; the next command identifies them in the given axis, which they excite."""
    runs, imported = result.runs, result.already_imported
    if not runs and imported:
        return Headline(
            f"already imported: {counted(len(imported), 'log')}, as they are", first_names(imported), pasted("status")
        )
    files, noted = [r.file for r in runs], sum(len(r.warnings) for r in runs)
    joint = ("--joint",) if len(files) > 1 else ()
    says = f"{counted(len(runs), 'run')}, {sum(r.duration_s for r in runs):.0f} s, "
    logs = list(dict.fromkeys(Path(r.log).resolve().name for r in runs if r.log is not None))
    return Headline(
        says + (counted(noted, "note") if noted else "nothing to note"),
        f"{first_names(logs) or 'standard input'}: SI and radians, one clock, gaps left as gaps",
        pasted("identify", files, "--axis", axis, *joint, "-o", "models/") if files else "",
    )
