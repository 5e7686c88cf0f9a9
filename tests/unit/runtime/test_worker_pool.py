"""A copy of the process answers in full or not at all, and leaves nothing behind."""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from fieldsid.runtime import worker_pool
from fieldsid.runtime.worker_pool import MAX_WORKERS, await_background, can_fork, dumps, fork_worker, loads, run_in_background

needs_copies = pytest.mark.skipif(not can_fork(), reason="needs Linux, a second core and no other threads")


def answer_of(work):
    """What a copy's work comes to."""
    with fork_worker(work) as copy:
        return copy.answer()


@needs_copies
def test_a_copy_answers_with_what_its_work_comes_to():
    assert answer_of(lambda: b"x" * 2**20) == b"x" * 2**20  # more than a pipe holds
    assert int(answer_of(lambda: str(os.getpid()).encode())) != os.getpid()


@needs_copies
def test_what_a_copy_says_is_not_heard(capfd):
    assert answer_of(lambda: str(os.write(1, b"out")).encode() + str(os.write(2, b"err")).encode()) == b"33"
    assert capfd.readouterr() == ("", "")


@needs_copies
@pytest.mark.parametrize("work", [lambda: 1 / 0, lambda: os._exit(9), lambda: "no bytes"], ids=["raises", "dies", "no bytes"])
def test_a_copy_that_came_to_nothing_has_no_answer(work):
    assert answer_of(work) is None


@needs_copies
def test_an_error_beside_a_copy_ends_it():
    with pytest.raises(ValueError, match="here"), fork_worker(lambda: [threading.Event().wait(60.0), b""][1]) as copy:
        raise ValueError("here")
    with pytest.raises(ChildProcessError):
        os.waitpid(copy.process, os.WNOHANG)


@needs_copies
def test_copies_that_have_answered_are_seen_off_by_the_next():
    for _ in range(5):
        answer_of(lambda: b"")
    assert len(worker_pool._ENDING) == 1
    last = worker_pool._ENDING[0]
    answer_of(lambda: b"")
    assert last not in worker_pool._ENDING
    with pytest.raises(ChildProcessError):
        os.waitpid(last, os.WNOHANG)


@needs_copies
def test_where_no_copy_is_to_be_had_nothing_stays_open(monkeypatch):
    def refused():
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(worker_pool.os, "fork", refused)
    ends = len(list(Path("/proc/self/fd").iterdir()))
    assert fork_worker(lambda: b"") is None
    assert len(list(Path("/proc/self/fd").iterdir())) == ends


@needs_copies
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
    monkeypatch.setattr(worker_pool, "_warns", lambda: True)
    assert fork_worker(lambda: b"") is None


def test_mappings_that_are_read_only_are_read_back_as_such():
    value = {"signals": MappingProxyType({"yaw_rad": np.arange(3.0)}), "name": "run7"}
    again = loads(dumps(value))
    assert isinstance(again["signals"], MappingProxyType)
    np.testing.assert_array_equal(again["signals"]["yaw_rad"], np.arange(3.0))
    assert again["name"] == "run7"


def signed(path, seconds=0.0):
    """Return work that takes so long and leaves who has done it."""
    return lambda: (time.sleep(seconds), path.write_text(str(os.getpid())))


def test_what_could_be_put_off_is_done_at_once_outside_of_a_tour(tmp_path):
    run_in_background(signed(tmp_path / "a"))
    assert (tmp_path / "a").read_text() == str(os.getpid())


@needs_copies
def test_what_is_put_off_is_done_in_copies_and_waited_for(tmp_path):
    files = [tmp_path / str(i) for i in range(MAX_WORKERS + 1)]
    with await_background():
        with await_background():
            run_in_background(signed(files[0], 0.3))
        assert not files[0].exists()  # an inner one leaves it to the outer one
        for file in files[1:]:
            run_in_background(signed(file, 0.3))
        assert files[-1].read_text() == str(os.getpid())  # no more copies than there may be
    assert len({file.read_text() for file in files}) == len(files)


@needs_copies
def test_what_went_wrong_in_a_copy_is_met_again_here(tmp_path):
    def refused():
        raise PermissionError("no")

    def tour():
        with await_background():
            run_in_background(refused)
            run_in_background(signed(tmp_path / "after"))

    with pytest.raises(PermissionError, match="no"):
        tour()
    with await_background():  # and leaves nothing behind
        run_in_background(signed(tmp_path / "again"))
    assert (tmp_path / "again").exists()


@needs_copies
def test_after_an_error_nothing_that_was_put_off_is_done_again():
    done = []

    def failing():
        done.append(os.getpid())
        raise PermissionError("no")

    def tour():
        with await_background():
            run_in_background(failing)
            raise ValueError("the tour")

    with pytest.raises(ValueError, match="the tour"):
        tour()
    assert done == []
