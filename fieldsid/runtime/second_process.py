"""A process of its own beside one that must not wait: given a task, asked now and then for the answer.

Begun anew rather than forked: threads, sockets and files of the first are none of its own. It ends with the first.
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
    """One process and at most one task; started with the first of them."""

    def __init__(self) -> None:
        self._ours: Connection | None = None
        self._process: Any = None
        self.is_busy = False

    def give(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Let it call a function of a module with arguments that can be sent; what it is at is to be done."""
        if self._ours is None:
            context = get_context("spawn")
            self._ours, theirs = context.Pipe()
            self._process = context.Process(target=_work, args=(theirs,), daemon=True)
            self._process.start()
            theirs.close()
        self._ours.send_bytes(dumps((function, arguments)))
        self.is_busy = True

    def answer(self, *, wait: bool = False) -> Any:
        """Return what was answered, a FieldsidError where the function raised one; None while there is nothing.

        Raises FieldsidError where the process has ended by itself.
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
        """End it, whatever it is at."""
        if self._ours is not None:
            self._ours.close()
            self._process.terminate()
            self._process.join()
        self._ours, self.is_busy = None, False


def _work(theirs: Connection) -> None:
    """Answer tasks until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # typed at the first process, which ends this one
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
