"""A test of what must come to an end, which fails where it does not."""

from __future__ import annotations

import signal
from contextlib import contextmanager

WAITING = 20
"""How many times as long as it may work something may take in all, on a machine that does other things."""


@contextmanager
def in_time(seconds):
    """Be inside work that fails with TimeoutError after so many seconds of processor time."""

    def ring(*_):
        raise TimeoutError(f"no end within {seconds} s of processor time, or {WAITING * seconds} s in all")

    before = {s: signal.signal(s, ring) for s in (signal.SIGPROF, signal.SIGALRM)}
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.alarm(WAITING * seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.alarm(0)
        for which, handler in before.items():
            signal.signal(which, handler)
