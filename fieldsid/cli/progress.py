"""For commands that take seconds: an existing output is refused before the work, and a terminal shows the progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from rich.live import Live

from fieldsid.artifacts import check_output
from fieldsid.cli.console import messages, say, shows_progress
from fieldsid.cli.session import session
from fieldsid.errors import UsageError

if TYPE_CHECKING:
    from fieldsid.fitting.jit_warmup import Warmup

FILES = (".yaml", ".yml", ".json", ".csv", ".parquet")
"""Suffixes of the files that commands write: a path that ends so is not meant as a folder."""
LINE_EVERY_S = 5.0
"""Seconds between two lines of progress where standard error is no terminal."""


def refuse_existing(*paths: Path | None, force: bool) -> None:
    """Raise ArtifactError for an output that exists or cannot be written; called before the work and not after it."""
    for path in paths:
        if path is not None:
            check_output(path, force=force)


def refuse_closed(folder: Path | None) -> None:
    """Raise ArtifactError for a folder that cannot be written to, UsageError for the name of a file; called before the work."""
    from fieldsid.figures.kinds import is_figure

    if folder is not None and (is_figure(folder) or folder.suffix in FILES) and not folder.is_dir():
        raise UsageError(
            f"`{folder}` is a {'figure' if is_figure(folder) else 'file'}'s name, and what is written here is a folder",
            found=f"-o {folder}",
            hint=f"`-o {folder.with_suffix('')}/`",
        )
    if folder is not None:
        check_output(folder / "-", force=True)


def refuse_place(output: Path | None, *, force: bool) -> None:
    """Raise an error for a place that figures cannot be written to: a file name as `refuse_figure` does, else `refuse_closed`."""
    from fieldsid.figures.kinds import is_figure

    if output is not None and is_figure(output):
        refuse_figure(output, force=force)
    else:
        refuse_closed(output)


def refuse_figure(path: Path | None, *, force: bool) -> None:
    """Raise ArtifactError for a figure file that exists, UsageError for a suffix of no figure; called before the work."""
    from fieldsid.figures.kinds import kind_of

    if path is not None:
        kind_of(path)
    refuse_existing(path, force=force)


@contextmanager
def trying(says: str) -> Iterator[Callable[[str], None]]:
    """Yield a function that shows on stderr what is being tried: on a terminal at once, elsewhere every LINE_EVERY_S seconds."""
    console = messages()
    if not shows_progress(console):
        yield _throttled(says, say)
        return
    # Without automatic refresh: its thread would keep the search from using a second core.
    with Live(console=console, auto_refresh=False, transient=True) as line:
        yield lambda text: line.update(f"{says}: {text}", refresh=True)


def _throttled(says: str, show: Callable[[str], None], clock: Callable[[], float] = monotonic) -> Callable[[str], None]:
    """Return a function that shows what is being tried, at most once in LINE_EVERY_S seconds."""
    last = clock()

    def show_if_due(text: str) -> None:
        nonlocal last
        if clock() - last >= LINE_EVERY_S:
            last = clock()
            show(f"{says}: {text}")

    return show_if_due


@contextmanager
def compiling(*more: Callable[[], None]) -> Iterator[Warmup]:
    """Compile the kernels in a forked worker while the context runs, the first time on a machine; a terminal shows that.

    more: functions that compile other kernels. Yields the warm-up, which is the session's where the command is part of one; see
    `fitting.jit_warmup.warming_up`.
    """
    from fieldsid.fitting.jit_warmup import warming_up

    if (shared := session()) is not None:
        yield shared.warmup
        return
    console = messages()
    with warming_up(lambda text: console.print(text) if shows_progress(console) else None, more) as warmup:
        yield warmup


@contextmanager
def compiling_first() -> Iterator[None]:
    """Compile the kernels on two cores before the context runs, the first time on a machine."""
    with compiling() as warmup:
        warmup.compile_now()
        yield


def get_ready(*modules: str) -> None:
    """Import the modules of a command and load its compiled kernels, while a worker reads its logs."""
    for module in modules:
        import_module(module)
    from fieldsid.fitting.jit_warmup import load_compiled

    load_compiled()
