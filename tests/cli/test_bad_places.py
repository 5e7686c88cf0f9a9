"""Places that cannot be read or written are said before any work is done, and are no bug of ours."""

from __future__ import annotations

import os

import pytest
from cli import trial

from fieldsid.logs import load_run, save_run


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    trial.flown(tmp_path)
    trial.model_file(tmp_path)
    return tmp_path


WRITES = [
    "identify run7.parquet --axis yaw -o {}",
    "compare truth.yaml run7.parquet -o {}",
    "turn-radius truth.yaml --rudder-max 0.3 -o {}",
    "import run7.parquet -o {}",
    "diagnose run7.parquet --axis yaw -o {}/d.yaml",
    "extend truth.yaml run7.parquet --add servo_lag -o {}/m.yaml",
    "schedule design truth.yaml --fin-limit 0.3 -o {}/g.yaml",
    "simulate truth.yaml --maneuver doublet -o {}/s.csv",
]


@pytest.mark.parametrize("line", WRITES)
def test_a_folder_that_nothing_can_be_written_to_is_refused_at_once(run_cli, here, monkeypatch, line):
    allowed = os.access
    monkeypatch.setattr(os, "access", lambda path, mode, **more: not mode & os.W_OK and allowed(path, mode, **more))
    monkeypatch.setattr("fieldsid.fitting.fit.fit", lambda *_a, **_m: pytest.fail("it was fitted first"))
    answer = run_cli(*line.format("out").split())
    assert (answer.code, answer.out) == (2, "")
    assert "cannot be written: Permission denied" in answer.err
    assert "hint: name a place that can be written" in answer.err
    assert sorted(p.name for p in here.iterdir()) == ["run7.parquet", "truth.yaml"]


@pytest.mark.parametrize("line", WRITES)
def test_a_file_is_no_folder(run_cli, here, line):
    (here / "notes").write_text("mine")
    answer = run_cli(*line.format("notes").split())
    assert (answer.code, answer.out) == (2, "")
    assert "`notes` is a file, not a folder" in answer.err
    assert (here / "notes").read_text() == "mine"


def test_a_folder_where_a_file_is_needed_is_said_with_what_it_holds(run_cli, here):
    (here / "notes").mkdir()
    (here / "notes" / "a.txt").write_text("calm")
    answer = run_cli("compare", "notes", "run7.parquet")
    assert answer.code == 2
    assert answer.err.startswith("error: `notes` is a folder, where a file is needed\n  found: it holds a.txt\n")
    assert "  found: nothing but `a.txt`\n" in run_cli("report", "notes").err


@pytest.mark.parametrize("line", ["identify {} --axis yaw", "compare truth.yaml {}", "import {} -o out"])
def test_a_closed_folder_is_no_bug_and_stops_no_other_log(run_cli, here, monkeypatch, line):
    closed = here / "closed"
    closed.mkdir()
    save_run(load_run(here / "run7.parquet").between(0, 30), closed / "other.csv")
    opened = os.stat

    def stat(path, *args, **more):
        if "closed" in str(path):
            raise PermissionError(13, "Permission denied", str(path))
        return opened(path, *args, **more)

    monkeypatch.setattr(os, "stat", stat)
    command, *rest = line.split()
    place = rest.index("{}")
    answer = run_cli(command, *rest[:place], "run7.parquet", "closed/other.csv", *rest[place + 1 :])
    assert answer.code == 1
    assert "skipped `closed/other.csv`: `closed/other.csv` cannot be read: Permission denied" in answer.err
    assert "hint: ask the owner of its folder" in answer.err


def test_what_the_system_does_not_let_us_reach_is_no_bug(run_cli, here, monkeypatch):
    def refuse(*_args, **_more):
        raise PermissionError(13, "Permission denied", "truth.yaml")

    monkeypatch.setattr("fieldsid.models.model.load_record", refuse)
    answer = run_cli("history", "truth.yaml")
    assert answer.code == 2
    assert "`truth.yaml` cannot be reached: Permission denied" in answer.err


def test_links_that_lead_nowhere_or_round_are_named(run_cli, here):
    (here / "gone.csv").symlink_to("nowhere.csv")
    (here / "loop.csv").symlink_to("loop.csv")
    answer = run_cli("import", "gone.csv", "loop.csv", "run7.parquet", "-o", "out")
    assert answer.code == 1
    assert "`gone.csv` is a link to nothing\n  found: it points to `nowhere.csv`" in answer.err
    assert "`loop.csv` cannot be read: Too many levels of symbolic links" in answer.err


NAMES = ["日本", "-x", "new\nline", "[b]", "a_{b^c$"]
MORE_NAMES = [
    pytest.param(name, marks=pytest.mark.slow) for name in ("Grün Fahrt", "a;b", "per%cent", "{c}", "quo'te", "a.b.c", "a$b$c")
]


@pytest.mark.parametrize("name", [*NAMES, *MORE_NAMES])
def test_any_name_is_read_and_written(run_cli, here, name):
    log = save_run(load_run(here / "run7.parquet"), here / f"{name}.csv")
    assert run_cli("identify", f"./{log.name}", "--axis", "yaw", "-o", "m", "--no-figures").code == 0
    assert [p.name for p in (here / "m").iterdir()] == [f"{name}_yaw.yaml"]
    assert run_cli("compare", here / "m" / f"{name}_yaw.yaml", log, "-o", "out").code == 0
