"""sysid report: one HTML file for the log book, or PDF: verdicts, figures, numbers, lineage."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit
from fieldsid.cli.progress import get_ready
from fieldsid.logs.run import Note
from fieldsid.page import Page

if TYPE_CHECKING:
    from fieldsid.trial_folder.state import FolderState


class Options(options.Options):
    """What `sysid report` takes."""

    files: options.Paths = options.argument(
        "[FOLDER|FILE...]", "A trial folder, or files of one; the folder it is run in if not given.", None
    )
    output: Path | None = options.option(
        "-o --output FILE", "report.html in the folder if not given; .pdf is printed by a browser."
    )
    force: bool = options.FORCE


@options.takes(Options)
def command(given: Options) -> Body:
    """Write what a trial has come to into one file: HTML that needs no network, or PDF.

    Verdicts first; the runs with the doctor's findings; each model against its measurement, to zoom and read off; where it fails;
    the effects tried; the falling error; parameters, laws, radius and gains; what was made from what; the commands to repeat it.
    A PDF needs Chromium, Chrome, Edge or Brave; without one print the HTML from any browser.

    Example: sysid report

    Example: sysid report pandan -o pandan.pdf
    """
    force = given.force
    state = _state(given.files or [Path()])
    path = given.output or state.folder / "report.html"
    from fieldsid.reporting.write import check_report, written
    from fieldsid.results.trial import Report, ReportVerdict

    check_report(path, force=force)
    get_ready()
    context, text = written(state, path, force=force)
    result = Report(
        file=str(path),
        bytes=path.stat().st_size,
        verdicts=tuple(ReportVerdict(v["what"], v["says"]) for v in context["verdicts"]),
        runs=tuple(r["name"] for r in context["runs"]),
        models=tuple(context["models"]),
        figures=text.count('<svg class="chart"') + text.count('<svg class="bars"'),
        skipped=tuple(context["skipped"]),
    )
    from fieldsid.cli.headlines.trial import headline_of_report

    notes = [Note("not_in_report", line, {}) for line in result.skipped]
    page = Page("", closing=tuple(f"{v.what}: {v.says}" for v in result.verdicts[1:]))
    return emit(result, render=page, headline=headline_of_report(result, state.folder), notes=notes)


def _state(given: Sequence[Path]) -> FolderState:
    """Return the state of the given folder, or of the folder above the given files; raises UsageError for anything else."""
    from fieldsid.errors import UsageError
    from fieldsid.trial_folder.state import state_of

    missing = [p for p in given if not p.exists()]
    if missing:
        raise UsageError(f"`{missing[0]}` is not there", found="no such file or folder", hint="`sysid report FOLDER`")
    if len(given) == 1 and given[0].is_dir():
        return state_of(given[0])
    if any(p.is_dir() for p in given):
        raise UsageError("one folder, or files", found=", ".join(map(str, given)), hint="give the folder alone")
    above = Path(os.path.commonpath([p.resolve().parent for p in given]))
    here = Path()
    return state_of(here if above == here.resolve() else above, files=given)
