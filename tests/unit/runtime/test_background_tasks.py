"""Background tasks leave on the disk what they would have left here, and their errors are met."""

from __future__ import annotations

import os
import time

import pytest

from fieldsid.runtime import worker_pool
from fieldsid.runtime.background_tasks import MAX_WORKERS, BackgroundTasks


def signed(path, seconds=0.0):
    """Return work that takes so long and leaves who has done it."""
    return lambda: (time.sleep(seconds), path.write_text(str(os.getpid())))


def test_a_task_is_done_at_once_where_this_process_cannot_be_forked(tmp_path, monkeypatch):
    monkeypatch.setattr(worker_pool.sys, "platform", "darwin")
    with BackgroundTasks() as later:
        later.run(signed(tmp_path / "a"))
    assert (tmp_path / "a").read_text() == str(os.getpid())


@pytest.mark.forks
def test_what_is_put_off_is_done_in_copies_and_waited_for(tmp_path):
    files = [tmp_path / str(i) for i in range(MAX_WORKERS + 1)]
    with BackgroundTasks() as later:
        for file in files:
            later.run(signed(file, 0.3))
        assert files[-1].read_text() == str(os.getpid())  # no more workers than there may be
    assert len({file.read_text() for file in files}) == len(files)


@pytest.mark.forks
def test_what_went_wrong_in_a_copy_is_met_again_here(tmp_path):
    def refused():
        raise PermissionError("no")

    def tour():
        with BackgroundTasks() as later:
            later.run(refused)
            later.run(signed(tmp_path / "after"))

    with pytest.raises(PermissionError, match="no"):
        tour()
    with BackgroundTasks() as later:  # and leaves nothing behind
        later.run(signed(tmp_path / "again"))
    assert (tmp_path / "again").exists()


@pytest.mark.forks
def test_after_an_error_nothing_that_was_put_off_is_done_again():
    done = []

    def failing():
        done.append(os.getpid())
        raise PermissionError("no")

    def tour():
        with BackgroundTasks() as later:
            later.run(failing)
            raise ValueError("the tour")

    with pytest.raises(ValueError, match="the tour"):
        tour()
    assert done == []
