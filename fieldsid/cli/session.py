"""What the commands of one tour share, passed to each as the object of its context."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from fieldsid.fitting.jit_warmup import Warmup
    from fieldsid.runtime.background_tasks import BackgroundTasks


@dataclass(frozen=True, slots=True)
class Session:
    """The compile warm-up under way, and the background tasks that draw figures."""

    warmup: Warmup
    tasks: BackgroundTasks


def session_of(context: typer.Context) -> Session | None:
    """Return the session that a command is part of; None for a command on its own."""
    return context.find_object(Session)


def tasks_of(context: typer.Context) -> BackgroundTasks | None:
    """Return the background tasks of the command's session; None for a command on its own."""
    session = session_of(context)
    return None if session is None else session.tasks


def drawn_at(context: typer.Context, path: Path | None, plot: Callable[[], Any], *, force: bool) -> str | None:
    """Draw a figure to a file and return that, None where none is asked for; with the other tasks of the command's session."""
    if path is None:
        return None
    from fieldsid.figures.canvas import save

    return str(save(plot(), path, force=force, tasks=tasks_of(context)))


@contextmanager
def drawing(context: typer.Context) -> Iterator[BackgroundTasks]:
    """Yield the background tasks of the command's session; for a command on its own new ones, waited for at the end."""
    from fieldsid.runtime.background_tasks import BackgroundTasks

    session = session_of(context)
    if session is not None:
        yield session.tasks
        return
    with BackgroundTasks() as own:
        yield own


def drawn_in(context: typer.Context, output: Path | None, plots: Mapping[str, Callable[[], Any]], *, force: bool) -> list[str]:
    """Draw figures by their names in a folder, the only one at a figure's name, and return the files; none without a place."""
    if output is None:
        return []
    from fieldsid.figures.canvas import save
    from fieldsid.figures.kinds import figure_at

    def place(name: str) -> Path:
        return figure_at(output, name, is_one=len(plots) == 1)

    with drawing(context) as own:
        return [str(save(plot(), place(name), force=force, tasks=own)) for name, plot in plots.items()]
