"""Make every Ctrl-C effective: where a library may discard it during an import, or Python cannot raise it, it is raised again.

Python raises KeyboardInterrupt at any point of the program. During an import a library may mistake it for a missing module or
discard it in C, and in a finaliser no exception can be raised: the program would then continue to its end.
"""

from __future__ import annotations

import _thread
import signal
import sys
from time import sleep
from types import FrameType
from typing import Never

AGAIN_S = 0.05
"""Time after which an interrupt that may have been discarded is raised again."""


class _Pending:
    """Whether there was an interrupt that may have been discarded, and that the program has not handled yet."""

    is_open = False


_ASKED = _Pending()


def heed_interrupts() -> None:
    """Make every Ctrl-C end this process's work; where its caller ignores them, as `nohup` does, they stay ignored."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        sys.unraisablehook = _unraisable
        signal.signal(signal.SIGINT, _interrupted)


def meet_interrupt() -> bool:
    """Return whether there was an unhandled interrupt, and mark it as handled."""
    was_open, _ASKED.is_open = _ASKED.is_open, False
    return was_open


def _interrupted(_number: int, frame: FrameType | None) -> Never:
    if _is_import(frame):
        _raise_later()
    raise KeyboardInterrupt


def _unraisable(what: sys.UnraisableHookArgs) -> None:
    if isinstance(what.exc_value, KeyboardInterrupt):
        _raise_later()
    else:
        sys.__unraisablehook__(what)


def _raise_later() -> None:
    _ASKED.is_open = True
    _thread.start_new_thread(_raise_again, ())


def _raise_again() -> None:
    sleep(AGAIN_S)
    if _ASKED.is_open:
        _thread.interrupt_main()


def _is_import(frame: FrameType | None) -> bool:
    while frame is not None and frame.f_globals.get("__name__") != "importlib._bootstrap":
        frame = frame.f_back
    return frame is not None
