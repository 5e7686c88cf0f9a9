"""What the commands of a tour share, and the drawing of figures, in the background tasks of the tour or in new ones."""

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
    """Return the session that the running command is part of; None for a single command."""
    return _SESSION.get()


@contextmanager
def in_session(shared: Session | None) -> Iterator[None]:
    """Run the context as part of a session; None for a single command."""
    before = _SESSION.set(shared)
    try:
        yield
    finally:
        _SESSION.reset(before)


@contextmanager
def figure_tasks() -> Iterator[BackgroundTasks]:
    """Yield the background tasks of the command's session; for a single command new ones, waited for at the end."""
    from fieldsid.runtime.background_tasks import BackgroundTasks

    if (shared := session()) is not None:
        yield shared.tasks
        return
    with BackgroundTasks() as tasks:
        yield tasks


def draw_figure(path: Path | None, plot: Callable[[], Any], *, force: bool) -> str | None:
    """Draw a figure to a file and return its path; None where no file is named."""
    if path is None:
        return None
    from fieldsid.figures.canvas import save

    shared = session()
    return str(save(plot(), path, force=force, tasks=None if shared is None else shared.tasks))


def draw_figures(output: Path | None, plots: Mapping[str, Callable[[], Any]], *, force: bool) -> list[str]:
    """Draw figures, by their names, to a folder and return the files; none without an output.

    An output with the name of a figure is the file of the only one, or a part of the name of each of several.
    """
    if output is None:
        return []
    from fieldsid.figures.canvas import save
    from fieldsid.figures.kinds import figure_at

    def place(name: str) -> Path:
        return figure_at(output, name, is_one=len(plots) == 1)

    with figure_tasks() as tasks:
        return [str(save(plot(), place(name), force=force, tasks=tasks)) for name, plot in plots.items()]
