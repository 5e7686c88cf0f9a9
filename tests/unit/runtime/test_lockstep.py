"""Two processes that go through the same computation share its maps, and come to what one comes to alone."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from fieldsid.runtime import worker_pool
from fieldsid.runtime.lockstep import MAX_ITEMS, Lockstep, parallel_map


def slowly(item):
    """An item and the process that has evaluated it, late enough for the other to take its share."""
    time.sleep(0.01)
    return item, os.getpid()


def no_process_is_left():
    """Whether this process has no other to wait for."""
    try:
        os.waitpid(-1, os.WNOHANG)
    except ChildProcessError:
        return True
    return False


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


@pytest.mark.forks
def test_a_worker_is_kept_from_map_to_map_and_ends_with_the_context():
    with Lockstep() as both:
        taken = [{process for _, process in both.map(slowly, range(8))} for _ in range(3)]
        assert taken[0] == taken[1] == taken[2]
        (worker,) = taken[0] - {os.getpid()}
    parallel_map(slowly, range(2))  # its end is waited for when the next is forked
    with pytest.raises(ChildProcessError):
        os.waitpid(worker, 0)


@pytest.mark.forks
def test_what_comes_after_the_context_is_done_once(tmp_path):
    with Lockstep() as both:
        both.map(slowly, range(4))
    with (tmp_path / "processes").open("a") as out:
        out.write(f"{os.getpid()}\n")
    time.sleep(0.05)
    assert (tmp_path / "processes").read_text() == f"{os.getpid()}\n"


@pytest.mark.forks
def test_both_processes_go_on_from_equal_values():
    with Lockstep() as both:
        total = 0
        for _ in range(4):
            done = both.map(lambda item: (*slowly(item), "x" * 2**18), range(total, total + 8))  # more than a pipe holds
            total = sum(value for value, _, _ in done)
        assert total == 8 * (8 * (8 * 28 + 28) + 28) + 28
        assert len({process for _, process, _ in done}) == 2


@pytest.mark.forks
def test_a_worker_that_has_come_elsewhere_is_left_for_another():
    here, places = os.getpid(), iter(range(100))
    with Lockstep(state=lambda: next(places) if os.getpid() == here else 7) as both:
        assert [item for item, _ in both.map(slowly, range(6))] == list(range(6))
        first = {process for _, process in both.map(slowly, range(6))}
        assert first == {here}  # the worker had come to another place: all was done here
        assert len({process for _, process in both.map(slowly, range(6))}) == 2


@pytest.mark.forks
@pytest.mark.parametrize("how", ["raises", "dies", "is killed"])
def test_a_worker_that_ends_on_its_way_costs_its_share_alone(how):
    here = os.getpid()
    with Lockstep() as both:
        (worker,) = {process for _, process in both.map(slowly, range(8))} - {here}
        if os.getpid() != here and how == "raises":
            raise ValueError("in the worker only")
        if os.getpid() != here and how == "dies":
            os._exit(9)
        if how == "is killed":
            os.kill(worker, signal.SIGKILL)
        time.sleep(0.05)
        assert [item for item, _ in both.map(slowly, range(8))] == list(range(8))
        assert [item for item, _ in both.map(slowly, range(8))] == list(range(8))


@pytest.mark.forks
def test_an_error_here_ends_a_worker_that_is_kept():
    def fails(item):
        if item == 3:
            raise ValueError("no 3")
        return slowly(item)

    with Lockstep() as both:
        both.map(slowly, range(4))
        with pytest.raises(ValueError, match="no 3"):
            both.map(fails, range(4))
    assert no_process_is_left()


@pytest.mark.forks
def test_a_map_within_a_map_is_done_by_whoever_is_at_it():
    with Lockstep() as both:
        for _ in range(2):
            found = both.map(lambda i: {process for _, process in both.map(slowly, range(i, i + 3))}, range(4))
            assert all(len(processes) == 1 for processes in found)


@pytest.mark.parametrize("count", [0, 1, MAX_ITEMS - 1, MAX_ITEMS, 2 * MAX_ITEMS])
def test_any_number_of_items_comes_back_in_order(count):
    with Lockstep() as both:
        assert both.map(lambda i: i * i, range(count)) == [i * i for i in range(count)]


@pytest.mark.forks
def test_no_pipe_is_left_open(monkeypatch):
    ends = len(list(Path("/proc/self/fd").iterdir()))
    with Lockstep() as both:
        both.map(slowly, range(4))
    assert len(list(Path("/proc/self/fd").iterdir())) == ends
    monkeypatch.setattr(worker_pool, "can_fork", lambda: False)
    assert {process for _, process in parallel_map(slowly, range(4))} == {os.getpid()}
    assert len(list(Path("/proc/self/fd").iterdir())) == ends
