"""Runs read beside other work are the runs read alone, and what is wrong with a file is told by the command itself."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from cli import trial

from fieldsid.cli import inputs
from fieldsid.cli.inputs import STDIN, read_runs
from fieldsid.errors import DataError, LogError, UsageError
from fieldsid.logs import load_run, save_run


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    return [trial.flown(folder, seed=k, name=f"run{k}") for k in (1, 2)]


@pytest.fixture
def nothing_read(monkeypatch):
    """As in a process that has not read a log before."""
    monkeypatch.setattr(inputs, "READING", ())


@pytest.mark.forks
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


@pytest.mark.forks
def test_the_files_are_read_in_the_copy(files, nothing_read, monkeypatch):
    here = os.getpid()
    read = inputs._read

    def elsewhere(path, **more):
        assert os.getpid() != here
        return read(path, **more)

    monkeypatch.setattr(inputs, "_read", elsewhere)
    assert [run.name for run in read_runs(files, meanwhile=lambda: None)] == ["run1", "run2"]


def test_a_process_that_has_read_logs_before_reads_them_itself(files, monkeypatch):
    read_runs(files)
    monkeypatch.setattr(inputs, "fork_worker", lambda _work: pytest.fail("a copy was made"))
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

    def note(path, **_more):
        seen.append((path, os.getpid()))
        raise LogError("enough")

    monkeypatch.setattr(inputs, "_read", note)
    with pytest.raises(LogError, match="enough"):
        read_runs([STDIN], meanwhile=lambda: None)
    assert seen == [(STDIN, os.getpid())]


def test_two_legs_of_one_log_are_two_runs(files, run_cli, tmp_path):
    legs = [tmp_path / f"leg{k}.parquet" for k in (1, 2)]
    for leg, part in zip(legs, (["--to", 15], ["--from", 15.05]), strict=True):
        assert run_cli("import", files[0], *part, "-o", leg).code == 0
    assert [run.name for run in read_runs(legs)] == ["leg1", "leg2"]


@pytest.mark.parametrize(
    ("places", "names"),
    [
        (["a/run7.csv", "b/run7.csv"], ["a_run7", "b_run7"]),
        (["a/x/run7.csv", "b/x/run7.csv"], ["a_x_run7", "b_x_run7"]),
        (["a/run7.csv", "a/run7.csv.gz"], ["run7_csv", "run7_gz"]),
        (["a/run7.csv", "b/run7.csv", "b/a_run7.csv"], ["a_run7", "b_run7", "a_run7_2"]),
        (["a/v1.2.csv", "a/v1.3.csv"], ["v1.2", "v1.3"]),
        (["a/Grün 7.csv", "b/Grün 7.csv"], ["a_Grün 7", "b_Grün 7"]),
    ],
)
def test_files_that_share_a_name_are_told_apart(files, tmp_path, places, names):
    run, paths = load_run(files[0]), [tmp_path / place for place in places]
    for k, path in enumerate(paths):
        save_run(run.between(0.0, 20.0 + k), path)
    assert [r.name for r in read_runs(paths)] == names


def test_a_file_that_cannot_be_read_does_not_change_the_names_of_the_others(files, tmp_path):
    paths = [save_run(load_run(files[k]), tmp_path / folder / "run7.csv") for k, folder in enumerate("ab")]
    paths[0].write_text("")
    skipped: list[Path] = []
    assert [r.name for r in read_runs(paths, refused=lambda path, _error: skipped.append(path))] == ["b_run7"]
    assert skipped == [paths[0]]


def test_the_same_data_are_refused_in_any_file(files, tmp_path):
    for name in ("copy.parquet", "copy.csv"):
        copy = save_run(load_run(files[0]), tmp_path / name)
        with pytest.raises(UsageError, match="holds the same data as") as caught:
            read_runs([files[0], files[1], copy])
        assert caught.value.hint == f"leave `{copy}` out"


@pytest.mark.forks
@pytest.mark.parametrize("beside", [False, True])
def test_of_several_files_those_that_can_be_read_are(files, nothing_read, tmp_path, beside):
    (tmp_path / "cut.csv").write_text("time_s,yaw_rad\n")
    told: list[tuple[Path, str]] = []
    paths = [tmp_path / "cut.csv", *files, tmp_path / "gone.csv"]
    runs = read_runs(
        paths, refused=lambda path, error: told.append((path, str(error))), meanwhile=(lambda: None) if beside else None
    )
    assert [run.name for run in runs] == ["run1", "run2"]
    assert [path for path, _ in told] == [paths[0], paths[3]]
    assert "has no rows" in told[0][1]
    assert "found: " in told[0][1]
    with pytest.raises(DataError, match="no log is left"):
        read_runs([paths[0], paths[3]], refused=lambda _path, _error: None)
    with pytest.raises(LogError, match="has no rows"):
        read_runs([paths[0]], refused=lambda _path, _error: None)
