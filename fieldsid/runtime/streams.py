"""The standard streams of the process, each of them there: one that is closed or cannot be written stops no work."""

from __future__ import annotations

import io
import os
import sys
from typing import Any


class _Unheard(io.FileIO):
    """A file that takes all it is given: messages that nobody can get are no reason to end otherwise."""

    def write(self, data: Any) -> int:
        """Write as a file does, and where it cannot, say that all was written."""
        try:
            return super().write(data) or 0
        except OSError:
            return len(data)


def have_streams() -> bool:
    """Open those streams that are closed, so that no file gets their numbers, and return whether the output was open.

    A closed input is an empty one; messages that cannot be written are lost. Letters that a console lacks are shown as codes.
    """
    closed = [name for name in ("stdin", "stdout", "stderr") if vars(sys)[name] is None]
    if "stdin" in closed:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: PTH123, SIM115 - for as long as the process lasts
    if "stdout" in closed:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - the same
    number, encoding = (os.open(os.devnull, os.O_WRONLY), "utf-8") if "stderr" in closed else (2, sys.stderr.encoding)
    messages = io.BufferedWriter(_Unheard(number, "w", closefd=False))
    sys.stderr = io.TextIOWrapper(messages, encoding, errors="backslashreplace", line_buffering=True)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    return "stdout" not in closed
