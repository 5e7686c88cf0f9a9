"""What a command that takes seconds does for who waits: refuse an output that exists at once, show what is being tried."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

from rich.live import Live

from fieldsid.artifacts import check_output
from fieldsid.cli.console import messages


def refuse_existing(*paths: Path | None, force: bool) -> None:
    """Refuse outputs that exist, or cannot be written, before the work is done and not after it; raises ArtifactError."""
    for path in paths:
        if path is not None:
            check_output(path, force=force)


def refuse_closed(folder: Path | None) -> None:
    """Refuse a folder that nothing can be written to, before the work is done and not after it; raises ArtifactError."""
    if folder is not None:
        check_output(folder / "-", force=True)


def refuse_figure(path: Path | None, *, force: bool) -> None:
    """Refuse a figure's file that exists, or of a kind that is not drawn, before the work; raises ArtifactError or UsageError."""
    from fieldsid.figures.kinds import kind_of

    if path is not None:
        kind_of(path)
    refuse_existing(path, force=force)


@contextmanager
def trying(says: str) -> Iterator[Callable[[str], None]]:
    """Yield a function that shows what is being tried, on stderr and only on a terminal."""
    console = messages()
    if not console.is_terminal:
        yield lambda _text: None
        return
    # drawn by hand: a thread that redraws would keep the search from using a second core
    with Live(console=console, auto_refresh=False, transient=True) as line:
        yield lambda text: line.update(f"{says}: {text}", refresh=True)


@contextmanager
def compiling(*besides: Callable[[], None]) -> Iterator[Callable[[Sequence[Callable[..., object]]], None]]:
    """Be inside what fits later: the first time on a machine a copy of this process compiles, and a terminal is told.

    Yields what is to be called before the first fit, see `fitting.ahead.compiling_ahead`.
    """
    from fieldsid.fitting.jit_warmup import warming_up

    console = messages()
    with warming_up(lambda text: console.print(text) if console.is_terminal else None, besides) as help_along:
        yield help_along


@contextmanager
def compiling_first() -> Iterator[None]:
    """Be inside what fits at once: the first time on a machine that compiles on two cores."""
    from fieldsid.fitting.jit_warmup import WARMUP_KERNELS

    with compiling() as help_along:
        help_along(WARMUP_KERNELS)
        yield


def get_ready(*modules: str) -> None:
    """Import what a command needs and load what it compiled: what can be done while its logs are read."""
    for module in modules:
        import_module(module)
    from fieldsid.fitting.jit_warmup import load_compiled

    load_compiled()
