"""Ctrl-C that is never lost: where a library swallows it while it is imported, or Python cannot raise it, it is asked for again.

Python raises KeyboardInterrupt wherever the program is. In the middle of an import a library may take it for a module that is
not there, or clear it away in C, and in what is called when an object goes nothing can be raised: the job would go on to its end.
"""

from __future__ import annotations

import _thread
import signal
import sys
from time import sleep
from types import FrameType
from typing import Never

AGAIN_S = 0.05
"""How long after an interrupt that may be lost it is asked for again."""


class _Asked:
    """Whether an interrupt was asked for that may be lost, and the program has not met it yet."""

    is_open = False


_ASKED = _Asked()


def heed_interrupts() -> None:
    """Have every Ctrl-C end what this process does; where its caller has them ignored, as `nohup` does, they stay ignored."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        sys.unraisablehook = _unraisable
        signal.signal(signal.SIGINT, _interrupted)


def meet_interrupt() -> bool:
    """Return whether an interrupt was asked for that nobody met, which then is met."""
    was_open, _ASKED.is_open = _ASKED.is_open, False
    return was_open


def _interrupted(_number: int, frame: FrameType | None) -> Never:
    if _is_import(frame):
        _ask_later()
    raise KeyboardInterrupt


def _unraisable(what: sys.UnraisableHookArgs) -> None:
    if isinstance(what.exc_value, KeyboardInterrupt):
        _ask_later()
    else:
        sys.__unraisablehook__(what)


def _ask_later() -> None:
    _ASKED.is_open = True
    _thread.start_new_thread(_ask_again, ())


def _ask_again() -> None:
    sleep(AGAIN_S)
    if _ASKED.is_open:
        _thread.interrupt_main()


def _is_import(frame: FrameType | None) -> bool:
    while frame is not None and frame.f_globals.get("__name__") != "importlib._bootstrap":
        frame = frame.f_back
    return frame is not None
