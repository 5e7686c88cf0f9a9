"""A second process for tasks of a process that must not wait: it is given a task and polled for the answer.

It is spawned rather than forked, so that it does not share threads, sockets and files of the first. It ends with the first.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from fieldsid.errors import FieldsidError
from fieldsid.runtime.pickling import dumps, loads
from fieldsid.runtime.worker_pool import IS_WORKER


class SecondProcess:
    """One process with at most one task at a time; started with the first task."""

    def __init__(self) -> None:
        self._ours: Connection | None = None
        self._process: Any = None
        self.is_busy = False

    def give(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Let the process call a module-level function with picklable arguments; the previous task must have been answered."""
        if self._ours is None:
            context = get_context("spawn")
            self._ours, theirs = context.Pipe()
            self._process = context.Process(target=_work, args=(theirs,), daemon=True)
            self._process.start()
            theirs.close()
        self._ours.send_bytes(dumps((function, arguments)))
        self.is_busy = True

    def answer(self, *, wait: bool = False) -> Any:
        """Return the answer, or the FieldsidError that the function raised; None while there is no answer.

        Raises FieldsidError where the process has ended unexpectedly.
        """
        if self._ours is None or not self.is_busy or not (wait or self._ours.poll()):
            return None
        self.is_busy = False
        try:
            return loads(self._ours.recv_bytes())
        except EOFError as error:
            self.close()
            raise FieldsidError("the process beside this one has ended", found="no answer", hint="try it alone") from error

    def close(self) -> None:
        """End the process, also within a task."""
        if self._ours is not None:
            self._ours.close()
            self._process.terminate()
            self._process.join()
        self._ours, self.is_busy = None, False


def _work(theirs: Connection) -> None:
    """Answer tasks until the connection is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the first process, which ends this one
    os.environ[IS_WORKER] = "1"
    while True:
        try:
            function, arguments = loads(theirs.recv_bytes())
        except EOFError:
            return
        try:
            answer = function(*arguments)
        except FieldsidError as error:
            answer = error
        theirs.send_bytes(dumps(answer))
