"""A test of what must come to an end, which fails where it does not."""

from __future__ import annotations

import signal
from contextlib import contextmanager


@contextmanager
def in_time(seconds):
    """Be inside work that fails with TimeoutError after so many seconds."""

    def ring(*_):
        raise TimeoutError(f"no end within {seconds} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
