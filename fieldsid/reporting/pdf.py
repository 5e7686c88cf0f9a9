"""A page as PDF, printed by an installed browser with the print rules of the style sheet."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from fieldsid.artifacts import replacing
from fieldsid.errors import ArtifactError, UsageError

BROWSERS = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge", "msedge",
    "brave-browser",
)  # fmt: skip
PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Microsoft/Edge/Application/msedge.exe",
)
LONGEST_S = 120


def browser() -> str | None:
    """Return the browser that prints, None where none is installed."""
    found = (shutil.which(name) for name in BROWSERS)
    return next((b for b in found if b), None) or next((p for p in PLACES if Path(p).is_file()), None)


def check_browser(path: Path) -> str:
    """Return the browser that prints; raises UsageError where there is none, saying what to do instead."""
    program = browser()
    if program is None:
        raise UsageError(
            f"`{path}` needs a browser that prints: Chromium, Chrome, Edge or Brave",
            found="none of them",
            hint=f"write `{path.with_suffix('.html')}`, open it in any browser and print it to a file",
        )
    return program


def print_pdf(html: str, path: Path, *, force: bool = False) -> Path:
    """Print an HTML text to a PDF file; raises UsageError without a browser, ArtifactError where it does not print."""
    program = check_browser(path)
    with TemporaryDirectory() as folder, replacing(path, force=force) as temporary:
        page, printed = Path(folder) / "report.html", Path(folder) / "report.pdf"  # a file with a name, for another program
        page.write_text(html, encoding="utf-8")
        # a browser does not start its sandbox for root, the usual user in a container
        boxed = [] if getattr(os, "geteuid", lambda: 1)() else ["--no-sandbox"]
        words = [
            program, "--headless=new", *boxed, "--disable-gpu", "--no-first-run", f"--user-data-dir={folder}/profile",
            "--no-pdf-header-footer", "--virtual-time-budget=5000", f"--print-to-pdf={printed}", page.as_uri(),
        ]  # fmt: skip
        try:
            done = subprocess.run(words, capture_output=True, text=True, timeout=LONGEST_S, check=False)
        except subprocess.TimeoutExpired as error:
            raise ArtifactError(
                f"`{program}` does not print", found=f"no end after {LONGEST_S} s", hint="print the HTML"
            ) from error
        if not printed.exists() or not printed.stat().st_size:
            message = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
            raise ArtifactError(f"`{program}` printed nothing", found=message[:200], hint="write HTML, and print it by hand")
        temporary.write_bytes(printed.read_bytes())
    return path
