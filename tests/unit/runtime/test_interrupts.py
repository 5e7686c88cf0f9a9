"""Ctrl-C is met wherever it comes: what swallows it while it is imported, or cannot raise it, only delays the end."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

LONG_S = 20
JOB = """
import os, signal, sys, time
sys.path.insert(0, {folder!r})
from fieldsid.cli import app
def job(_arguments):
    {first}
    end = time.monotonic() + {long}
    while time.monotonic() < end:
        sum(range(1000))
    return 0
app._dispatch = job
app.entry()
"""
ASKED = "os.kill(os.getpid(), signal.SIGINT)"


def ended(tmp_path, first, start=lambda: None, long=LONG_S):
    program = JOB.format(folder=str(tmp_path), first=first, long=long)
    began = time.monotonic()
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, preexec_fn=start, check=False)
    return done, time.monotonic() - began


def asked_for():
    """What a terminal gives a program: a pytest in the background has it ignored."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.parametrize(
    ("first", "module"),
    [
        (ASKED, ""),
        ("import swallows", "try:\n    import inner\nexcept:\n    pass\n"),
        (
            "import swallows",
            "try:\n    import inner\nexcept BaseException as error:\n    raise AttributeError('half of it') from None\n",
        ),
        (f"class Gone:\n        def __del__(self): {ASKED}; time.sleep(0.01)\n    gone = Gone(); del gone", ""),
    ],
    ids=["plain", "swallowed", "half_done", "unraisable"],
)
def test_an_interrupt_ends_the_job(tmp_path, first, module):
    (tmp_path / "swallows.py").write_text(module)
    (tmp_path / "inner.py").write_text(f"import os, signal\n{ASKED}\nfor _ in range(1000): pass\n")
    done, took = ended(tmp_path, first, asked_for)
    assert (done.returncode, done.stderr) == (130, "interrupted\n")
    assert took < LONG_S


def test_a_process_that_is_to_ignore_interrupts_does(tmp_path):
    import signal

    done, _ = ended(tmp_path, ASKED, lambda: signal.signal(signal.SIGINT, signal.SIG_IGN), long=0.2)
    assert (done.returncode, done.stderr) == (0, "")
