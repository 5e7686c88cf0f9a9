"""Headlines of what becomes of a log: inspect, import."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.cli.headlines.words import Body, named
from fieldsid.logs.run import EXPLAINING
from fieldsid.page import counted
from fieldsid.trial_folder.journal import is_trial
from fieldsid.trial_folder.make import LOGS, MAPPING

PROOF = "evidence"
"""Code of a finding that says why a column was taken for a signal: nothing is wrong there."""


def of_inspection(body: Body, mapping: Path | None) -> Headline:
    """Return what a log holds, and how it becomes a run."""
    log, signals, findings = (
        " + ".join([body["path"], *body["joined"]]),
        body["signals"],
        [f for f in body["findings"] if f["code"] != PROOF],
    )
    said = counted(len(findings), "finding") if findings else "nothing found that would spoil an identification"
    if not signals:
        says = (
            f"{log} is no run yet: {'none of its names says what its numbers are' if not body['problem'] else 'see the findings'}"
        )
    else:
        says = f"{log} holds {counted(len(signals), 'signal')} for {body['span']}; {said}"
    how = (
        "its own names"
        if not body["mapping_needed"]
        else f"`{mapping}`"
        if mapping
        else "a proposed mapping: check units and signs"
    )
    return Headline(says, f"{body['format']}, {counted(len(body['channels']), 'channel')}, by {how}", _after(body, mapping))


def _after(body: Body, mapping: Path | None) -> str:
    known = body["mapping_file"] or mapping
    if body["mapping_needed"] and known is None:
        return typed_with("--write-mapping", MAPPING, *(("--force",) if Path(MAPPING).exists() else ()))
    if not body["signals"]:  # an import is refused until somebody has said what the columns are
        return pasted("guide", "trial")
    if _is_taken(Path(body["path"]), known) and not body["import_options"] and not body["joined"]:
        return pasted("import")
    files = [*(["--join"] if body["joined"] else []), body["path"], *body["joined"]]
    return pasted("import", *files, *(("--mapping", known) if known else ()), *body["import_options"], "-o", "runs/")


def _is_taken(log: Path, mapping: str | Path | None) -> bool:
    """Whether an import here takes a log, among others, and its mapping from the trial folder."""
    is_here = is_trial(Path()) and log.resolve().parent == Path(LOGS).resolve()
    return is_here and (mapping is None or Path(mapping).resolve() == Path(MAPPING).resolve())


def of_import(body: Body, axis: str) -> Headline:
    """Return how many runs there are now, and the first fit of them, in the plane that they excite."""
    runs, there = body["runs"], body["already_imported"]
    if not runs and there:
        return Headline(f"already imported: {counted(len(there), 'log')}, as they are", named(there), pasted("status"))
    seconds = sum(float(r["duration_s"]) for r in runs)
    files = [r["file"] for r in runs]
    joint = ("--joint",) if len(files) > 1 else ()
    noted = sum(n["code"] not in EXPLAINING for r in runs for n in r["notes"])
    says = f"{counted(len(runs), 'run')}, {seconds:.0f} s, " + (counted(noted, "note") if noted else "nothing to note")
    return Headline(
        says,
        f"{named(_logs(runs))}: SI and radians, one clock, gaps left as gaps",
        pasted("identify", files, "--axis", axis, *joint, "-o", "models/") if files else "",
    )


def _logs(runs: Sequence[Body]) -> list[str]:
    return list(dict.fromkeys(Path(r["log"]).resolve().name for r in runs))
