"""Ensure that the standard streams exist, so that a closed or unwritable stream does not stop the program."""

from __future__ import annotations

import io
import os
import sys
from typing import Any


class _DiscardingFile(io.FileIO):
    """A file that accepts all output: messages that cannot be delivered must not change how the program ends."""

    def write(self, data: Any) -> int:
        """Write the data; where that fails, return as if all had been written."""
        try:
            return super().write(data) or 0
        except OSError:
            return len(data)


def have_streams() -> bool:
    """Open the closed standard streams, so that no file gets their descriptors, and return whether the output was open.

    A closed input reads as empty; messages that cannot be written are discarded. Characters that a console lacks are escaped.
    """
    closed = [name for name in ("stdin", "stdout", "stderr") if vars(sys)[name] is None]
    if "stdin" in closed:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: PTH123, SIM115 - for as long as the process lasts
    if "stdout" in closed:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - the same
    number, encoding = (os.open(os.devnull, os.O_WRONLY), "utf-8") if "stderr" in closed else (2, sys.stderr.encoding)
    messages = io.BufferedWriter(_DiscardingFile(number, "w", closefd=False))
    sys.stderr = io.TextIOWrapper(messages, encoding, errors="backslashreplace", line_buffering=True)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    return "stdout" not in closed
