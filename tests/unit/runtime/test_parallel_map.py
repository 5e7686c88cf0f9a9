"""Two processes share a map, and come to what one comes to alone."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from fieldsid.runtime import worker_pool
from fieldsid.runtime.parallel_map import MAX_ITEMS, parallel_map


def slowly(item):
    """An item and the process that has evaluated it, late enough for the other to take its share."""
    time.sleep(0.01)
    return item, os.getpid()


@pytest.mark.forks
@pytest.mark.parametrize("which", ["worker", "parent"])
def test_an_error_of_the_function_is_raised_and_leaves_no_process(which):
    here = os.getpid()

    def fails(item):
        if (os.getpid() == here) is (which == "parent"):
            return 1 // 0
        time.sleep(0.05)
        return item

    if which == "parent":
        with pytest.raises(ZeroDivisionError):
            parallel_map(fails, range(8))
    else:  # what the worker died of is done here, where it does not fail
        assert parallel_map(fails, range(8)) == list(range(8))
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)


@pytest.mark.forks
def test_what_a_worker_died_of_is_done_here():
    here = os.getpid()

    def dies_elsewhere(item):
        if os.getpid() != here:
            os._exit(9)
        time.sleep(0.01)
        return item

    assert parallel_map(dies_elsewhere, range(12)) == list(range(12))


@pytest.mark.parametrize("count", [0, 1, MAX_ITEMS, MAX_ITEMS + 1])
def test_any_number_of_items_comes_back_in_order(count):
    assert parallel_map(lambda i: i * i, range(count)) == [i * i for i in range(count)]


@pytest.mark.forks
def test_no_pipe_is_left_open(monkeypatch):
    ends = len(list(Path("/proc/self/fd").iterdir()))
    assert len({process for _, process in parallel_map(slowly, range(8))}) == 2
    assert len(list(Path("/proc/self/fd").iterdir())) == ends
    monkeypatch.setattr(worker_pool, "can_fork", lambda: False)
    assert {process for _, process in parallel_map(slowly, range(4))} == {os.getpid()}
    assert len(list(Path("/proc/self/fd").iterdir())) == ends
