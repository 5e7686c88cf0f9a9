"""A trial folder never trips: every line it says is next is pasted, until `sysid status` says that nothing is left to do."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest
from cli import trial
from walk import Walk

from fieldsid.demo.steps import PLAN
from fieldsid.demo.trial import make_trial
from fieldsid.demo.vehicle import SPEED, flown, hidden_vehicle, training_maneuver
from fieldsid.logs import load_run, save_run
from fieldsid.models.axis import Axis
from fieldsid.planning.output.plan_file import load_plan

LAG = ("servo_lag", {"lag": 0.35})
DEGREES = 57.29577951308232


@pytest.fixture
def trial_with(run_cli, tmp_path, monkeypatch):
    """Return a function that makes a trial folder of logs, enters it, and gives the walk through it."""

    def make(*logs):
        monkeypatch.chdir(tmp_path)
        assert run_cli("init", "pandan").code == 0
        for log in logs:
            shutil.copy(log, tmp_path / "pandan/logs")
        monkeypatch.chdir(tmp_path / "pandan")
        return Walk(run_cli)

    return make


def foreign(run_file):
    """Write a run as a logger has it: degrees, under names of its own."""
    run, log = load_run(run_file), run_file.with_suffix(".csv")
    columns = {"time [s]": (run.time, 1), "heading [deg]": (run["yaw_rad"], DEGREES),
               "yaw rate [deg/s]": (run["yaw_rate_rad_s"], DEGREES), "rudder command [deg]": (run["rudder_rad"], DEGREES),
               "speed [m/s]": (run["surge_m_s"], 1)}  # fmt: skip
    rows = zip(*(factor * values for values, factor in columns.values()), strict=True)
    log.write_text("\n".join([";".join(columns), *(";".join(f"{v:.5f}" for v in row) for row in rows)]) + "\n")
    return log


def test_a_folder_with_one_log_of_foreign_names(trial_with, tmp_path):
    walk = trial_with(foreign(trial.flown(tmp_path, hidden=LAG)))
    walk.until_done()
    assert walk.steps[1] == "sysid inspect logs/run7.csv --write-mapping mapping.yaml --force"
    assert "sysid extend --add servo_lag" in walk.steps
    assert "sysid schedule verify" in walk.steps


@pytest.mark.parametrize("to_the_end", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_the_mapping_is_kept_whatever_it_is_called(run_cli, tmp_path, monkeypatch, to_the_end):
    monkeypatch.chdir(tmp_path)
    log = foreign(trial.flown(tmp_path, hidden=LAG)).name
    (tmp_path / "run7.parquet").unlink()
    walk = Walk(run_cli)
    assert walk.paste(f"sysid inspect {log} --write-mapping ours.yaml") == f"sysid import {log} --mapping ours.yaml -o runs/"
    next_ = walk.paste(f"sysid identify {log} --mapping ours.yaml -o models/")
    assert next_.endswith(" --mapping ours.yaml")
    if to_the_end:
        walk.until_done(next_)


def test_before_and_after_are_two_trials_and_the_folder_they_lie_in_compares_them(run_cli, tmp_path, monkeypatch):
    for seed, side in ((3, "before"), (4, "after")):
        monkeypatch.chdir(tmp_path)
        assert run_cli("init", side).code == 0
        trial.flown(tmp_path / side / "runs", seed=seed, name=f"run_{side}")
    walk = Walk(run_cli)
    for _ in range(2):
        monkeypatch.chdir(tmp_path)
        walk.paste(walk.paste("sysid status"))
    monkeypatch.chdir(tmp_path)
    assert walk.paste("sysid status") == "", "without a journal here it cannot tell whether they were compared already"
    step = json.loads(run_cli("status", "--json").out)["next"]
    assert "`sysid compare before after`" in step["why"]
    assert run_cli("compare", "before", "after").code == 0
    assert not (tmp_path / "gains.yaml").exists()


@pytest.mark.slow
def test_the_logs_of_the_tour(trial_with, tmp_path):
    model = hidden_vehicle("servo_lag")
    runs = [flown(model, training_maneuver(model), speed, seed) for seed, speed in enumerate((1.0, 1.2, 1.4, 1.8), 1848)]
    walk = trial_with(*(foreign(save_run(r, tmp_path / f"learn_{i}.parquet")) for i, r in enumerate(runs)))
    walk.until_done()


@pytest.mark.slow
def test_the_morning_of_the_readme_says_what_it_said_on_the_logs_of_the_tour(run_cli, trial_with, tmp_path):
    assert run_cli("plan", *PLAN.line.format(plan=tmp_path / "plan", speeds=SPEED, axis="yaw").split()[1:]).code == 0
    (leg,) = load_plan(tmp_path / "plan/plan.yaml").legs
    logs = make_trial(hidden_vehicle("servo_lag"), tmp_path / "flown", leg)
    trial_with(*logs.train, *logs.check)
    stated = re.sub("max_rad: .*", "max_rad: 0.26", Path("vehicle.yaml").read_text())
    Path("vehicle.yaml").write_text(re.sub("fin_rate_rad_s: .*", "fin_rate_rad_s: 1.5", stated))
    assert run_cli("inspect", "logs/learn_1.4.csv", "--write-mapping", "mapping.yaml", "--force").code == 0
    assert run_cli("import").code == 0
    morning = (Path(__file__).resolve().parents[2] / "README.md").read_text().split("## A morning")[1].split("```")[1]
    lines = [re.split(r"\s{2,}", line) for line in morning.strip().splitlines()]
    first = next(i for i, line in enumerate(lines) if line[0].startswith("sysid identify"))
    quoted = 0
    for line, *says in lines[first:]:
        done = run_cli(*shlex.split(line)[1:])
        assert done.code == 0, done.err
        if says and re.search("[0-9]|kept:", says[0]) and not says[0].startswith("port"):
            assert says[0] in " ".join(done.out.split())
            quoted += 1
    assert quoted == 4


@pytest.mark.slow
def test_pitch(trial_with, tmp_path):
    walk = trial_with(trial.flown(tmp_path, Axis.PITCH, hidden=LAG))
    walk.until_done()


@pytest.mark.slow
@pytest.mark.field
@pytest.mark.parametrize("logs", ["lauv/rudder_v*", "lauv/elevator_v*", "kvlcc2/*.dat"])
def test_a_vehicle_of_others(trial_with, shared_data, logs):
    trial_with(*sorted(shared_data.glob(logs))).until_done()
