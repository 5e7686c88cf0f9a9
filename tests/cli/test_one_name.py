"""One name for one thing: a fin's limit, what any command answers to, and a figure's file."""

from __future__ import annotations

import pytest
from cli import trial

from fieldsid.cli.voice import command_first
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model

TABLE = "speed_m_s,a22,b2,C0\n1.0,0.7,-0.5,0.01\n1.5,1.0,-0.97,0.02\n"


def table(folder):
    path = folder / "points.csv"
    path.write_text(TABLE)
    return path


@pytest.mark.parametrize(
    ("command", "given"),
    [
        (("turn-radius",), ("--rudder-max", "0.2")),
        (("turn-radius",), ("--fin-limit=0.2",)),
        (("schedule", "design"), ("--fin-limit", "0.2")),
        (("schedule", "design"), ("--rudder-max=0.2",)),
    ],
)
def test_a_fins_limit_has_one_name_and_is_understood_by_those_it_had(run_cli, tmp_path, command, given):
    asked, named = (run_cli(*command, table(tmp_path), *words, "--json").json["rows"] for words in (given, ("--fin-max", "0.2")))
    assert asked == named
    page = run_cli(*command, "--help").out
    assert "--fin-max" in page
    assert "--rudder-max" not in page
    assert "--fin-limit" not in page


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("--json status", "status --json"),
        ("--quiet --json schedule verify g.yaml", "schedule verify g.yaml --quiet --json"),
        ("--json inspect -- -a.csv", "inspect --json -- -a.csv"),
        ("status --json", "status --json"),
        ("--axis yaw", "--axis yaw"),
        ("--json", "--json"),
    ],
)
def test_what_every_command_answers_to_may_stand_before_it(typed, meant):
    assert command_first(typed.split()) == meant.split()


def test_json_before_the_command_is_json(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run_cli("--json", "status").json["schema"] == "fieldsid/status/1"
    assert run_cli("--quiet", "status").out == run_cli("status", "--quiet").out


@pytest.mark.parametrize(
    ("suffix", "begins"),
    [(".PNG", b"\x89PNG"), *(pytest.param(*of, marks=pytest.mark.slow) for of in ((".pdf", b"%PDF"), (".svg", b"<?xml")))],
)
def test_a_figures_name_is_a_figure_for_one_run_and_for_several_models(run_cli, tmp_path, suffix, begins):
    log, model = trial.flown(tmp_path, spec="zigzag"), trial.model_file(tmp_path)
    drawn = tmp_path / f"x{suffix}"
    assert run_cli("compare", model, log, "-o", drawn, "--json").json["runs"][0]["figure"] == str(drawn)
    assert drawn.read_bytes().startswith(begins)
    refused = run_cli("compare", model, log, "-o", drawn)
    assert (refused.code, refused.out) == (2, "")
    other = save_model(trial.vehicle(Axis.YAW, C0=0.05), tmp_path / "other.yaml")
    assert run_cli("compare", model, other, log, "-o", drawn, "--force", "--json").json["figures"] == [str(drawn)]
    changed = tmp_path / f"change{suffix}"
    assert run_cli("compare", model, other, "-o", changed).code == 0
    assert changed.is_file()


def test_of_several_runs_each_figure_has_the_name_that_was_given_and_its_own(run_cli, tmp_path):
    logs = [trial.flown(tmp_path, spec="zigzag", seed=i, name=f"run{i}") for i in range(2)]
    body = run_cli("compare", trial.model_file(tmp_path), *logs, "-o", tmp_path / "x.svg", "--json").json
    assert [r["figure"] for r in body["runs"]] == [str(tmp_path / f"x_truth_on_run{i}.svg") for i in range(2)]


def test_where_a_folder_is_written_a_figures_name_is_refused(run_cli, tmp_path):
    answer = run_cli("turn-radius", table(tmp_path), "--fin-max", "0.26", "-o", tmp_path / "x.pdf")
    assert answer.code == 2
    assert "is a figure's name" in answer.err
    assert not (tmp_path / "x.pdf").exists()


@pytest.mark.parametrize("name", ["model.yaml", "model.json"])
@pytest.mark.parametrize("line", ["identify run7.parquet --axis yaw", "plan --speeds 1.4"])
def test_where_a_folder_is_written_a_files_name_is_refused_too(run_cli, tmp_path, monkeypatch, line, name):
    monkeypatch.chdir(tmp_path)
    trial.flown(tmp_path)
    answer = run_cli(*line.split(), "-o", tmp_path / name)
    assert answer.code == 2
    assert f"hint: `-o {tmp_path / 'model'}/`" in answer.err
    assert not (tmp_path / name).exists()
