"""Ctrl-C that is never lost: what libraries swallow while they are imported, or Python while it clears up, is raised again.

Python raises KeyboardInterrupt wherever the program is. A library that tries an import may take it for a module that is not
there, and in what is called when an object goes, nothing can be raised at all: the job would go on to its end.
"""

from __future__ import annotations

import _thread
import signal
import sys
from time import sleep
from types import FrameType
from typing import Any, Never, cast

AGAIN_S = 0.01
"""How long after an interrupt that could not be raised it is asked for again."""


class _Asked:
    """Whether an interrupt came while something was imported: then nothing more is, and each import raises it anew."""

    in_import = False

    def find_spec(self, *_module: Any) -> None:
        """Find nothing, as a finder of modules that knows none; raise KeyboardInterrupt where one was asked for."""
        if self.in_import:
            raise KeyboardInterrupt


def heed_interrupts() -> None:
    """Have every Ctrl-C end what this process does; where its caller has them ignored, as `nohup` does, they stay ignored."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return
    asked = _Asked()

    def interrupted(_number: int, frame: FrameType | None) -> Never:
        asked.in_import = asked.in_import or _is_import(frame)
        raise KeyboardInterrupt

    def unraisable(what: sys.UnraisableHookArgs) -> None:
        if isinstance(what.exc_value, KeyboardInterrupt):
            _thread.start_new_thread(_ask_again, ())
        else:
            sys.__unraisablehook__(what)

    cast("list[Any]", sys.meta_path).insert(0, asked)
    sys.unraisablehook = unraisable
    signal.signal(signal.SIGINT, interrupted)


def _ask_again() -> None:
    sleep(AGAIN_S)
    _thread.interrupt_main()


def _is_import(frame: FrameType | None) -> bool:
    while frame is not None and frame.f_globals.get("__name__") != "importlib._bootstrap":
        frame = frame.f_back
    return frame is not None
