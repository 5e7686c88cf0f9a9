"""What the commands of one tour share, and where a command draws its figures: with the tour's other tasks, or with its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fieldsid.fitting.jit_warmup import Warmup
    from fieldsid.runtime.background_tasks import BackgroundTasks


@dataclass(frozen=True, slots=True)
class Session:
    """The compile warm-up under way, and the background tasks that draw figures."""

    warmup: Warmup
    tasks: BackgroundTasks


_SESSION: ContextVar[Session | None] = ContextVar("session", default=None)


def session() -> Session | None:
    """Return the session that the command under way is part of; None for a command on its own."""
    return _SESSION.get()


@contextmanager
def part_of(whole: Session | None) -> Iterator[None]:
    """Run a command as a part of a session, or on its own."""
    before = _SESSION.set(whole)
    try:
        yield
    finally:
        _SESSION.reset(before)


@contextmanager
def drawing() -> Iterator[BackgroundTasks]:
    """Yield the background tasks of the command's session; for a command on its own new ones, waited for at the end."""
    from fieldsid.runtime.background_tasks import BackgroundTasks

    if (shared := session()) is not None:
        yield shared.tasks
        return
    with BackgroundTasks() as own:
        yield own


def drawn_at(path: Path | None, plot: Callable[[], Any], *, force: bool) -> str | None:
    """Draw a figure to a file and return that, None where none is asked for."""
    if path is None:
        return None
    from fieldsid.figures.canvas import save

    shared = session()
    return str(save(plot(), path, force=force, tasks=None if shared is None else shared.tasks))


def drawn_in(output: Path | None, plots: Mapping[str, Callable[[], Any]], *, force: bool) -> list[str]:
    """Draw figures by their names in a folder, the only one at a figure's name, and return the files; none without a place."""
    if output is None:
        return []
    from fieldsid.figures.canvas import save
    from fieldsid.figures.kinds import figure_at

    def place(name: str) -> Path:
        return figure_at(output, name, is_one=len(plots) == 1)

    with drawing() as own:
        return [str(save(plot(), place(name), force=force, tasks=own)) for name, plot in plots.items()]
