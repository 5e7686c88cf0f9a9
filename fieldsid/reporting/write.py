"""Write the report on a folder's state, as HTML or PDF by the suffix of the file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fieldsid.artifacts import check_output, write_text
from fieldsid.errors import UsageError
from fieldsid.reporting.material import material_of
from fieldsid.reporting.page import html_of
from fieldsid.reporting.pdf import check_browser, print_pdf
from fieldsid.reporting.sections import context_of
from fieldsid.trial_folder.state import FolderState

KINDS = (".html", ".pdf")


def check_report(path: Path, *, force: bool) -> None:
    """Refuse a file to which no report can be written, before any work; raises UsageError and ArtifactError."""
    if path.suffix not in KINDS:
        raise UsageError("a report is HTML or PDF", found=f"`{path}`", hint=f"write `{path.with_suffix('.html')}`")
    check_output(path, force=force)
    if path.suffix == ".pdf":
        check_browser(path)


def written(state: FolderState, path: Path, *, force: bool) -> tuple[Mapping[str, Any], str]:
    """Write a report and return its context and its HTML text; raises UsageError and ArtifactError."""
    check_report(path, force=force)
    context = context_of(material_of(state))
    text = html_of(context)
    if path.suffix == ".pdf":
        print_pdf(text, path, force=force)
    else:
        write_text(path, text, force=force)
    return context, text
