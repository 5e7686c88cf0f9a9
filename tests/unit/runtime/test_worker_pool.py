"""A copy of the process answers in full or not at all, and leaves nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from fieldsid.runtime import worker_pool
from fieldsid.runtime.worker_pool import can_fork, fork_worker


def answer_of(work):
    """What a copy's work comes to."""
    with fork_worker(work) as copy:
        return copy.answer()


@pytest.mark.forks
def test_a_copy_answers_with_what_its_work_comes_to():
    assert answer_of(lambda: b"x" * 2**20) == b"x" * 2**20  # more than a pipe holds
    assert int(answer_of(lambda: str(os.getpid()).encode())) != os.getpid()


@pytest.mark.forks
def test_what_a_copy_says_is_not_heard(capfd):
    assert answer_of(lambda: str(os.write(1, b"out")).encode() + str(os.write(2, b"err")).encode()) == b"33"
    assert capfd.readouterr() == ("", "")


@pytest.mark.forks
@pytest.mark.parametrize("work", [lambda: 1 / 0, lambda: os._exit(9), lambda: "no bytes"], ids=["raises", "dies", "no bytes"])
def test_a_copy_that_came_to_nothing_has_no_answer(work):
    assert answer_of(work) is None


@pytest.mark.forks
def test_an_error_beside_a_copy_ends_it():
    with pytest.raises(ValueError, match="here"), fork_worker(lambda: [threading.Event().wait(60.0), b""][1]) as copy:
        raise ValueError("here")
    with pytest.raises(ChildProcessError):
        os.waitpid(copy.process, os.WNOHANG)


@pytest.mark.forks
def test_a_worker_that_has_answered_is_gone_when_the_next_is_forked():
    with fork_worker(lambda: b"") as worker:
        worker.answer()
    with fork_worker(lambda: b"") as following:
        with pytest.raises(ChildProcessError):
            os.waitpid(worker.process, 0)
        following.answer()


KILLED = """
import os, signal, sys, time
from fieldsid.runtime.worker_pool import fork_worker
worker = fork_worker(lambda: [time.sleep(60.0), b""][1])
print(worker.process, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.forks
def test_a_worker_ends_with_a_process_that_is_killed():
    killed = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, text=True, check=False)
    assert killed.returncode == -signal.SIGKILL
    worker = Path(f"/proc/{int(killed.stdout)}/stat")
    assert in_time(lambda: not worker.exists() or worker.read_text().rpartition(")")[2].split()[0] in "ZX", 5.0)


def in_time(is_so, seconds):
    """Whether something comes to be so within some seconds."""
    end = time.monotonic() + seconds
    while not (done := is_so()) and time.monotonic() < end:
        time.sleep(0.01)
    return done


@pytest.mark.forks
def test_where_no_copy_is_to_be_had_nothing_stays_open(monkeypatch):
    def refused():
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(worker_pool.os, "fork", refused)
    ends = len(list(Path("/proc/self/fd").iterdir()))
    assert fork_worker(lambda: b"") is None
    assert len(list(Path("/proc/self/fd").iterdir())) == ends


@pytest.mark.forks
def test_a_copy_copies_no_more():
    assert can_fork()
    assert answer_of(lambda: str(can_fork()).encode()) == b"False"


def test_nothing_is_copied_beside_another_thread():
    done = threading.Event()
    other = threading.Thread(target=done.wait)
    other.start()
    try:
        assert fork_worker(lambda: b"") is None
    finally:
        done.set()
        other.join()


def test_nothing_is_copied_elsewhere_than_on_linux(monkeypatch):
    monkeypatch.setattr(worker_pool.sys, "platform", "darwin")
    assert fork_worker(lambda: b"") is None


def test_nothing_is_copied_where_python_would_warn_of_it(monkeypatch):
    monkeypatch.setattr(worker_pool, "_fork_warns", lambda: True)
    assert fork_worker(lambda: b"") is None
