"""A log where a model is expected, a model where a log is expected, and both the wrong way round."""

from __future__ import annotations

import shlex

import pytest
from cli import trial

from fieldsid.logs import load_run, save_run


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_run(load_run(trial.flown(tmp_path)), tmp_path / "run7.csv")
    trial.model_file(tmp_path)
    return tmp_path


LOG_FOR_A_MODEL = [
    "compare LOG LOG",
    "extend LOG LOG --add servo_lag",
    "history LOG",
    "simulate LOG --maneuver doublet",
    "diagnose LOG --axis yaw --model LOG",
    "fit LOG",
    "turn-radius LOG",
    "schedule design LOG --fin-limit 0.2",
    "schedule verify LOG",
    "schedule export LOG",
    "plan --model LOG",
    "plan --from LOG",
]


@pytest.mark.parametrize("log", ["run7.csv", "run7.parquet"])
@pytest.mark.parametrize("line", LOG_FOR_A_MODEL)
def test_a_log_given_for_a_model_is_called_a_log_and_the_hint_makes_a_model(run_cli, here, line, log):
    answer = run_cli(*line.replace("LOG", log).split())
    assert answer.code == 2
    assert f"`{log}` is a log, not a" in answer.err
    assert f"\nhint: identify it first: `sysid identify {log} --axis yaw -o models/`" in answer.err


def test_the_hint_can_be_pasted(run_cli, here):
    err = run_cli("fit", "run7.csv").err
    assert run_cli(*shlex.split(err.split("`")[-2])[1:]).code == 0
    assert run_cli("fit", "models/run7_yaw.yaml").code == 2  # one speed only, but a model


@pytest.mark.parametrize("line", ["identify MODEL --axis yaw", "inspect MODEL", "import MODEL -o runs"])
def test_a_model_given_for_a_log_is_called_a_model(run_cli, here, line):
    answer = run_cli(*line.replace("MODEL", "truth.yaml").split())
    assert answer.code == 2
    assert "`truth.yaml` is a model file of this program, not a log" in answer.err
    assert "salvage" not in answer.err


@pytest.mark.parametrize("words", [("compare",), ("extend", "--add", "servo_lag")])
def test_run_and_model_may_stand_the_wrong_way_round(run_cli, here, words):
    name, *rest = words
    right, wrong = (
        run_cli(name, *files, *rest, "--force", "--json") for files in (("truth.yaml", "run7.csv"), ("run7.csv", "truth.yaml"))
    )
    assert right.json == wrong.json


@pytest.mark.parametrize("option", ["--mapping", "--vehicle"])
def test_another_file_of_ours_for_a_mapping_or_a_vehicle_is_named(run_cli, here, option):
    answer = run_cli("identify", "run7.csv", "--axis", "yaw", option, "truth.yaml")
    assert answer.code == 2
    assert "`truth.yaml` is another kind of file\n  found: schema: fieldsid/model/1" in answer.err


def test_a_model_given_for_a_schedule_is_led_to_what_makes_one(run_cli, here):
    answer = run_cli("schedule", "verify", "truth.yaml")
    assert answer.code == 2
    assert answer.err.endswith("\nhint: `sysid schedule design MODEL... -o gains.yaml` makes one\n")


def test_speeds_of_two_numbers_are_told_what_a_range_takes(run_cli, here):
    answer = run_cli("turn-radius", "truth.yaml", "--speeds", "1:2")
    assert answer.code == 2
    assert "found: 2 numbers, where low, high and step are needed" in answer.err
