"""Runs read beside other work are the runs read alone, and what is wrong with a file is told by the command itself."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from cli import trial

from fieldsid.cli import inputs
from fieldsid.cli.inputs import STDIN, read_runs
from fieldsid.copies import can_copy
from fieldsid.errors import LogError, UsageError

needs_copies = pytest.mark.skipif(not can_copy(), reason="needs Linux, a second core and no other threads")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    return [trial.flown(folder, seed=k, name=f"run{k}") for k in (1, 2)]


@pytest.fixture
def nothing_read(monkeypatch):
    """As in a process that has not read a log before."""
    monkeypatch.setattr(inputs, "READING", ())


@needs_copies
def test_runs_read_beside_other_work_are_those_read_alone(files, nothing_read):
    done: list[int] = []
    beside = read_runs(files, meanwhile=lambda: done.append(os.getpid()))
    assert done == [os.getpid()]
    for run, alone in zip(beside, read_runs(files), strict=True):
        assert (run.name, run.source, run.notes) == (alone.name, alone.source, alone.notes)
        assert list(run.signals) == list(alone.signals)
        for name in run.signals:
            np.testing.assert_array_equal(run[name], alone[name])
            assert not run[name].flags.writeable


@needs_copies
def test_the_files_are_read_in_the_copy(files, nothing_read, monkeypatch):
    here = os.getpid()
    read = inputs._read

    def elsewhere(path, mapping):
        assert os.getpid() != here
        return read(path, mapping)

    monkeypatch.setattr(inputs, "_read", elsewhere)
    assert [run.name for run in read_runs(files, meanwhile=lambda: None)] == ["run1", "run2"]


def test_a_process_that_has_read_logs_before_reads_them_itself(files, monkeypatch):
    read_runs(files)
    monkeypatch.setattr(inputs, "copied", lambda _work: pytest.fail("a copy was made"))
    assert [run.name for run in read_runs(files, meanwhile=lambda: None)] == ["run1", "run2"]


def test_what_is_wrong_with_a_file_is_told_as_ever(files, nothing_read, tmp_path):
    (tmp_path / "cut.csv").write_text("time_s,yaw_rad\n")
    for meanwhile in (None, lambda: None):
        with pytest.raises(LogError):
            read_runs([files[0], tmp_path / "cut.csv"], meanwhile=meanwhile)
        with pytest.raises(UsageError, match="given twice"):
            read_runs([files[0], files[0]], meanwhile=meanwhile)


def test_standard_input_is_read_here(monkeypatch):
    seen: list[tuple[Path, int]] = []

    def note(path, _mapping):
        seen.append((path, os.getpid()))
        raise LogError("enough")

    monkeypatch.setattr(inputs, "_read", note)
    with pytest.raises(LogError, match="enough"):
        read_runs([STDIN], meanwhile=lambda: None)
    assert seen == [(STDIN, os.getpid())]
