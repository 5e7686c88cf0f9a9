"""What the commands of one tour share, passed to each as the object of its context."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

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
