"""A trial folder: what a command takes from it, the line it leaves in the journal, and what `sysid status` makes of both."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
from contextlib import chdir
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import plan_legs
import pytest
import yaml
from cli import trial

from fieldsid.artifacts import to_yaml
from fieldsid.cli.headlines.typed import pasted
from fieldsid.cli.trial.filled import FILLS
from fieldsid.cli.trial.parsed import parse
from fieldsid.logs import load_run, save_run
from fieldsid.models.axis import Axis
from fieldsid.planning.output.plan_file import save_plan
from fieldsid.trial_folder.journal import Entry, Stamp, append
from fieldsid.trial_folder.state import state_of

BOTH_RUNS = ("runs/pulses_1.0.parquet", "runs/pulses_1.4.parquet")


@pytest.fixture(scope="module")
def prepared(run_shared, tmp_path_factory):
    """A trial folder with two runs."""
    folder = tmp_path_factory.mktemp("prepared")
    with chdir(folder):
        assert run_shared("init", "pandan").code == 0
    for speed in (1.0, 1.4):
        trial.flown(folder / "pandan" / "runs", speed=speed, name=f"pulses_{speed}")
    return folder / "pandan"


@pytest.fixture
def folder(prepared, tmp_path, monkeypatch):
    """A copy of it as the working folder."""
    place = shutil.copytree(prepared, tmp_path / "pandan")
    monkeypatch.chdir(place)
    return place


def journal(folder):
    return [json.loads(line) for line in (folder / "journal.jsonl").read_text().splitlines()]


def test_runs_and_the_folder_of_models_need_not_be_typed(run_cli, folder):
    answer = run_cli("identify", "--axis", "yaw", "--no-figures", "--json")
    assert [f["run"] for f in answer.json["fits"]] == ["pulses_1.0", "pulses_1.4"]
    assert "taken from the trial folder: -o models runs/pulses_1.0.parquet" in answer.err
    assert sorted(p.name for p in (folder / "models").iterdir()) == ["pulses_1.0_yaw.yaml", "pulses_1.4_yaw.yaml"]


def test_runs_that_excite_the_other_plane_alone_are_left_out_where_none_is_typed(run_cli, folder):
    trial.flown(folder / "runs", Axis.PITCH, name="stairs")
    run, pitching = load_run(folder / BOTH_RUNS[1]), load_run(folder / "runs/stairs.parquet")
    steady = replace(pitching, signals={**pitching.signals, "rudder_rad": 0.01 + 0.0 * pitching.time})
    save_run(steady, folder / "runs/stairs.parquet", force=True)
    still = {n: v for n, v in run.signals.items() if n != "rudder_rad"} | {"rudder_rad": 0.0 * run.time}
    save_run(replace(run, name="still", signals=still), folder / "runs/still.parquet")
    answer = run_cli("identify", "--axis", "yaw", "--no-figures", "--json")
    body = json.loads(answer.out)
    assert [f["run"] for f in body["fits"]] == ["pulses_1.0", "pulses_1.4"]
    assert "1 more excite the other plane alone" in answer.err
    # that in which no fin moves was flown for nothing: that is told
    assert [s["run"] for s in body["skipped_runs"]] == ["still"]


@pytest.mark.parametrize(
    ("words", "spared"),
    [
        (("identify", *BOTH_RUNS, "--axis", "yaw", "--joint", "-o", "models/"), "identify --axis yaw --joint"),
        (("identify", BOTH_RUNS[0], "--axis", "yaw"), f"identify {BOTH_RUNS[0]} --axis yaw"),
        (("diagnose", *BOTH_RUNS, "--axis", "yaw", "--model", "models/m.yaml"), "diagnose --axis yaw --model models/m.yaml"),
        (("turn-radius", "models/m.yaml"), "turn-radius"),
        (("schedule", "design", "models/m.yaml", "-o", "gains.yaml"), "schedule design -o gains.yaml"),
        (("schedule", "design", "elsewhere.yaml", "-o", "gains.yaml"), "schedule design elsewhere.yaml -o gains.yaml"),
        (("plan", "--axis", "yaw", "-o", "plan"), "plan --axis yaw"),
        (("effects", "show", "stall"), "effects show stall"),
    ],
)
def test_a_line_to_paste_leaves_out_just_what_the_folder_fills_in(folder, words, spared):
    (folder / "models").mkdir(exist_ok=True)
    trial.model_file(folder / "models").rename(folder / "models/m.yaml")
    assert pasted(*words) == f"sysid {spared}"


def test_a_command_that_comes_too_early_is_told_what_comes_before_it(run_cli, folder):
    for line in (("schedule", "verify"), ("compare",), ("extend", "--add", "servo_lag"), ("turn-radius",)):
        answer = run_cli(*line)
        assert answer.code == 2
        assert "and the trial folder does not give it\n" in answer.err
        assert answer.err.endswith("\nhint: there is no model of the runs yet: `sysid identify --axis yaw --joint`\n")
    assert "trial folder" not in run_cli("effects", "show").err


def test_a_command_that_comes_too_early_is_told_what_it_needs_itself(run_cli, folder):
    trial.model_file(folder / "models", Axis.PITCH)
    assert run_cli("turn-radius").err.endswith("hint: there is no model of the yaw yet: `sysid identify --axis yaw --joint`\n")
    assert run_cli("schedule", "verify").err.endswith("hint: no gains yet: `sysid schedule design -o gains.yaml`\n")
    for speed in (1.0, 1.4):
        (folder / f"runs/pulses_{speed}.parquet").unlink()
    trial.flown(folder / "runs", Axis.PITCH, name="pitch")
    assert "hint: there is no model of the yaw, and no run with a rudder: `sysid status`" in run_cli("turn-radius").err


@pytest.mark.usefixtures("batch_here")
def test_a_batch_that_could_use_nothing_leads_to_its_logs_and_not_to_a_trend(run_cli, folder):
    for run in (folder / "runs").iterdir():
        run.unlink()
    trial.flown(folder / "runs", Axis.PITCH, name="pitch")
    answer = run_cli("batch", "--axis", "yaw", "--json")
    assert (answer.code, json.loads(answer.out)["headline"]["next"]) == (1, "sysid inspect runs/pitch.parquet")


def test_what_is_typed_counts(run_cli, folder):
    body = run_cli("identify", "runs/pulses_1.4.parquet", "--axis", "yaw", "-o", "other", "--no-figures", "--json").json
    assert [f["model"] for f in body["fits"]] == ["other/pulses_1.4_yaw.yaml"]
    assert list((folder / "models").iterdir()) == []


def test_the_journal_holds_a_line_that_can_be_run_again_with_the_hashes_of_its_files(run_cli, folder):
    assert run_cli("identify", "--axis", "yaw", "--joint", "--no-figures").code == 0
    first, line = journal(folder)
    assert first["command"][:2] == ["sysid", "init"]
    assert shlex.join(line["command"]) == (
        "sysid identify --axis yaw --joint --no-figures runs/pulses_1.0.parquet runs/pulses_1.4.parquet -o models"
    )
    assert line["exit"] == 0
    assert {s["path"] for s in line["inputs"]} == {"runs/pulses_1.0.parquet", "runs/pulses_1.4.parquet", "vehicle.yaml"}
    (made,) = line["outputs"]
    assert made["path"] == "models/joint_yaw.yaml"
    assert made["sha256"] == sha256((folder / "models/joint_yaw.yaml").read_bytes()).hexdigest()


def test_a_command_that_fails_leaves_its_reason_and_bad_usage_nothing(run_cli, folder):
    assert run_cli("history", "nothing.yaml").code == 2
    assert run_cli("identify", "--axis", "sideways").code == 2
    _, line = journal(folder)
    assert (line["exit"], line["command"][1]) == (2, "history")
    assert "nothing.yaml" in line["verdict"]


def test_outside_a_trial_folder_nothing_is_taken_and_nothing_is_written(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    trial.flown(tmp_path, name="run7")
    assert run_cli("identify", "--axis", "yaw").code == 2
    assert run_cli("identify", "run7.parquet", "--axis", "yaw", "--no-figures").code == 0
    assert [p.name for p in tmp_path.iterdir()] == ["run7.parquet"]


def test_compare_takes_the_model_and_the_runs_that_it_was_not_fitted_to(run_cli, folder):
    assert run_cli("identify", "runs/pulses_1.4.parquet", "--axis", "yaw", "--no-figures").code == 0
    body = run_cli("compare", "--no-figures", "--json").json
    assert body["model"] == "models/pulses_1.4_yaw.yaml"
    assert [r["run"] for r in body["runs"]] == ["pulses_1.0"]


def test_status_leads_from_an_empty_folder_to_a_diagnosis(run_cli, folder):
    for run in sorted((folder / "runs").iterdir()):
        run.rename(folder.parent / run.name)
    assert run_cli("status", "--json").json["next"]["command"] == "sysid plan --axis yaw --speeds 0.8,1.4,2"
    for run in sorted(folder.parent.glob("*.parquet")):
        run.rename(folder / "runs" / run.name)
    line = run_cli("status", "--json").json["next"]["command"]
    assert line == "sysid identify --axis yaw --joint"
    assert run_cli(*shlex.split(line)[1:], "--no-figures").code == 0
    body = run_cli("status", "--json").json
    assert body["next"] == {"why": "no diagnosis yet", "command": "sysid diagnose --axis yaw"}
    assert body["verdict"] == "pandan: 2 runs, 1 model; nothing is stale"
    assert [len(f["made_from"]) for f in body["files"] if f["kind"] == "model"] == [2]


@pytest.mark.parametrize("name", ["runs/simulated.parquet", "simulated.parquet", "simulated.csv"])
def test_what_a_model_made_is_no_measured_run(run_cli, folder, name):
    trial.model_file(folder)
    assert run_cli("simulate", "truth.yaml", "--maneuver", "doublet", "-o", name).code == 0
    kinds = {f["path"]: f["kind"] for f in run_cli("status", "--json").json["files"]}
    assert kinds[name] == "simulated"
    answer = run_cli("identify", "--axis", "yaw", "--no-figures", "--json")
    assert [f["run"] for f in answer.json["fits"]] == ["pulses_1.0", "pulses_1.4"]


def test_the_fin_of_a_planned_leg_is_no_log(run_cli, folder):
    (folder / "plan").mkdir()
    (folder / "plan/plan.yaml").write_text("schema: fieldsid/plan/1\n")
    for name in ("plan/leg01_doublet_1.40m_s.csv", "logs/leg01.csv"):
        (folder / name).write_text("time_s,rudder_rad\n0,0\n0.05,0.1\n")
    kinds = {f["path"]: f["kind"] for f in run_cli("status", "--json").json["files"]}
    assert (kinds["plan/leg01_doublet_1.40m_s.csv"], kinds["logs/leg01.csv"]) == ("planned", "log")


@pytest.mark.parametrize(
    ("command", "verdict", "files", "next_"),
    [
        (("diagnose", "--axis", "yaw"), "unexplained: 2.3 x", (), "sysid diagnose --axis yaw --thorough"),
        (
            ("diagnose", "--axis", "yaw", "-o", "d.yaml"),
            "unexplained: 2.3 x",
            ("d.yaml",),
            "sysid diagnose --axis yaw -o d.yaml --thorough --force",
        ),
        (("diagnose", "--axis", "yaw", *BOTH_RUNS), "unexplained: 2.3 x", (), "sysid diagnose --axis yaw --thorough"),
        (
            ("diagnose", "--axis", "yaw", BOTH_RUNS[0], "--validate", BOTH_RUNS[1]),
            "unexplained: 2.3 x",
            (),
            "sysid diagnose --axis yaw runs/pulses_1.0.parquet --validate runs/pulses_1.4.parquet --thorough",
        ),
        (("diagnose", "--axis", "yaw", "--thorough"), "unexplained: 2.3 x", (), "sysid schedule design -o gains.yaml"),
        (("diagnose", "--axis", "yaw", "-o", "d.yaml"), "undecided: two", ("d.yaml",), "sysid plan --from d.yaml -o plan"),
    ],
)
def test_a_diagnosis_that_named_nothing_for_sure_is_followed_up(run_cli, folder, command, verdict, files, next_):
    assert run_cli("identify", "--axis", "yaw", "--joint", "--no-figures").code == 0
    outputs = tuple(Stamp(f, "", 0, 0) for f in files)
    append(folder, Entry("2026-01-01T00:00:00+00:00", ("sysid", *command), 0, 1.0, verdict, (), outputs))
    assert run_cli("status", "--json").json["next"]["command"] == next_


def test_a_diagnosis_that_was_acted_upon_is_not_asked_for_again(run_cli, folder):
    assert run_cli("identify", "--axis", "yaw", "--joint", "--no-figures").code == 0
    searched, extended_since = ("diagnose", "--axis", "yaw"), ("extend", "--add", "servo_lag")
    for minute, (command, verdict) in enumerate([(searched, "unexplained: 2.3 x"), (extended_since, "not kept")]):
        append(folder, Entry(f"2026-01-01T00:0{minute}:00+00:00", ("sysid", *command), 0, 1.0, verdict, (), ()))
    assert run_cli("status", "--json").json["next"]["command"] == "sysid schedule design -o gains.yaml"


def test_a_changed_run_makes_its_model_stale_and_the_gains_made_of_that(run_cli, folder):
    assert run_cli("identify", "--axis", "yaw", "--joint", "--no-figures").code == 0
    assert run_cli("schedule", "design", "-o", "gains.yaml").code == 0
    (folder / "runs" / "pulses_1.0.parquet").unlink()
    trial.flown(folder / "runs", speed=1.0, seed=4, name="pulses_1.0")
    body = run_cli("status", "--json").json
    why = {f["path"]: f["stale"] for f in body["files"]}
    assert why["models/joint_yaw.yaml"] == "runs/pulses_1.0.parquet has changed"
    assert why["gains.yaml"] == "models/joint_yaw.yaml is stale"
    again = body["next"]["command"]
    assert again == "sysid identify --axis yaw --joint --no-figures -o models --force"
    assert run_cli(*shlex.split(again)[1:]).code == 0
    body = run_cli("status", "--json").json
    assert body["stale"] == ["gains.yaml"]
    assert run_cli(*shlex.split(body["next"]["command"])[1:]).code == 0
    assert run_cli("status", "--json").json["stale"] == []


@pytest.mark.parametrize("kept", [True, False], ids=("by the journal", "without a journal"))
def test_a_changed_mapping_makes_what_was_read_with_it_stale(run_cli, folder, kept):
    for place in BOTH_RUNS:
        (folder / place).unlink()
    log = "logs/pulses.csv"
    (folder / "logs").mkdir(exist_ok=True)
    time = 0.1 * np.arange(300)
    table = np.column_stack([time, np.sin(time), np.cos(time), 10.0 * np.sign(np.sin(time))])
    np.savetxt(folder / log, table, delimiter=",", header="t,psi,r,helm", comments="")
    mapping = "time: {column: t, unit: s}\nsignals:\n  yaw_rad: {column: psi}\n  rudder_rad: {column: helm, unit: deg}\n"
    (folder / "mapping.yaml").write_text(f"schema: fieldsid/mapping/1\n{mapping}")
    assert run_cli("import").code == 0
    assert run_cli("identify", "--axis", "yaw", "--no-figures").code == 0
    assert run_cli("status", "--json").json["stale"] == []
    (folder / "mapping.yaml").write_text(f"schema: fieldsid/mapping/1\n{mapping}".replace("deg", "deg, sign: -1"))
    if not kept:
        (folder / "journal.jsonl").write_text("")
    body = run_cli("status", "--json").json
    assert {f["path"]: f["stale"] for f in body["files"]}["runs/pulses.parquet"] == "mapping.yaml has changed"
    assert body["stale"] == ["models/pulses_yaw.yaml", "runs/pulses.parquet"]
    again = body["next"]["command"]
    assert again.startswith(f"sysid import {log} ")
    assert ("--mapping mapping.yaml" in again) != kept
    before = load_run(folder / "runs/pulses.parquet")["rudder_rad"]
    assert run_cli(*shlex.split(again)[1:]).code == 0
    assert load_run(folder / "runs/pulses.parquet")["rudder_rad"] == pytest.approx(-before)
    assert run_cli("status", "--json").json["stale"] == ["models/pulses_yaw.yaml"]


def test_a_command_whose_reader_goes_away_has_its_line_in_the_journal(folder):
    command = f"{shlex.quote(sys.executable)} -m fieldsid effects new tow -o tow.yaml | head -c 0"
    lines = len(journal(folder))
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "tow.yaml").is_file()
    assert [entry["command"][1:3] for entry in journal(folder)[lines:]] == [["effects", "new"]]


def test_a_run_that_is_gone_is_said_and_makes_nothing_stale(run_cli, folder):
    assert run_cli("identify", "runs/pulses_1.4.parquet", "--axis", "yaw", "--no-figures").code == 0
    (folder / "runs" / "pulses_1.4.parquet").unlink()
    (model,) = (f for f in run_cli("status", "--json").json["files"] if f["kind"] == "model")
    assert (model["missing"], model["stale"]) == (["runs/pulses_1.4.parquet"], None)


def test_inputs_named_from_the_folder_above_are_found_from_inside_and_from_above(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for speed in (1.0, 1.4):
        trial.flown(tmp_path / "day" / "runs", speed=speed, name=f"pulses_{speed}")
    assert (
        run_cli("identify", "--axis", "yaw", "--no-figures", *(f"day/{run}" for run in BOTH_RUNS), "-o", "day/models").code == 0
    )
    for place, folder in ((tmp_path, Path("day")), (tmp_path / "day", Path())):
        monkeypatch.chdir(place)
        assert all(item.missing == () for item in state_of(folder).items)


def test_a_line_that_a_power_cut_left_is_told_and_the_next_one_stands_by_itself(run_cli, folder):
    with (folder / "journal.jsonl").open("a") as stream:
        stream.write('{"schema": "fieldsid/journal/1", "time": "2026-')
    assert run_cli("history", "nothing.yaml").code == 2
    answer = run_cli("status")
    assert "warning: 1 lines of the journal cannot be read [journal]" in answer.err
    assert "history: failed: " in answer.out


def test_status_of_another_folder_says_where_to_go(run_cli, folder, monkeypatch):
    monkeypatch.chdir(folder.parent)
    assert run_cli("status", "pandan", "--json").json["next"]["command"].startswith("cd pandan && sysid identify")
    answer = run_cli("status", "nowhere")
    assert answer.code == 2
    assert "`nowhere` is no folder" in answer.err


def test_status_tells_a_fin_limit_that_the_runs_contradict_until_it_is_corrected(run_cli, folder):
    vehicle = folder / "vehicle.yaml"
    vehicle.write_text(vehicle.read_text().replace("rudder_max_rad: 0.436", "rudder_max_rad: 0.1"))
    assert run_cli("status", "--json").json["warnings"] == []  # these runs were not imported here
    for run in sorted((folder / "runs").iterdir()):
        save_run(load_run(run), folder / "logs" / f"{run.stem}.csv")
    imported = run_cli("import", "logs/pulses_1.0.csv", "logs/pulses_1.4.csv", "-o", "runs", "--force")
    (line,) = (part for part in imported.err.splitlines() if "[saturated]" in part)
    assert "(and 1 more like it)" in line
    (told,) = run_cli("status", "--json").json["warnings"]
    assert told["code"] == "fin_limit"
    assert told["message"].startswith("vehicle.yaml: `rudder_max_rad: 0.1` is less than the 0.")
    vehicle.write_text(vehicle.read_text().replace("rudder_max_rad: 0.1", "rudder_max_rad: 0.4"))
    assert run_cli("status").err == ""
    vehicle.write_text("name: [")
    (told,) = run_cli("status", "--json").json["warnings"]
    assert told["code"] == "vehicle"


def test_what_was_beyond_a_limit_that_is_corrected_is_no_longer_said(run_cli, folder):
    vehicle = folder / "vehicle.yaml"
    vehicle.write_text(vehicle.read_text().replace("rudder_max_rad: 0.436", "rudder_max_rad: 0.1"))
    for run in sorted((folder / "runs").iterdir()):
        save_run(load_run(run), folder / "logs" / f"{run.stem}.csv")
    assert "[saturated]" in run_cli("import", "logs/pulses_1.0.csv", "-o", "runs", "--force").err
    identify = ("identify", "runs/pulses_1.0.parquet", "--axis", "yaw", "--no-figures", "--json", "--force")

    def told(*words):
        body = run_cli(*words).json
        return {w["code"] for f in body["fits"] for w in f["warnings"]}

    assert "fin_at_limit" in told(*identify)
    assert load_run(folder / "runs" / "pulses_1.0.parquet", fin_max_rad={"rudder_rad": 0.1}).notes[-1].code == "saturated"
    vehicle.write_text(vehicle.read_text().replace("rudder_max_rad: 0.1", "rudder_max_rad: 0.4"))
    assert not {"saturated", "fin_at_limit", "fin_limit"} & told(*identify)
    assert "saturated" not in {n.code for n in load_run(folder / "runs" / "pulses_1.0.parquet").notes}


def test_status_writes_nothing(run_cli, folder):
    before = (folder / "journal.jsonl").read_bytes()
    assert run_cli("status").code == 0
    assert (folder / "journal.jsonl").read_bytes() == before


def with_track(file):
    """The run of a file with the positions that its heading at 1.4 m/s makes."""
    run = load_run(file)
    steps = 1.4 * np.diff(run.time, prepend=run.time[0])
    track = {"x_m": np.cumsum(steps * np.cos(run["yaw_rad"])), "y_m": np.cumsum(steps * np.sin(run["yaw_rad"]))}
    save_run(replace(run, signals={**run.signals, **track}), file, force=True)


def test_turn_radius_takes_the_circles_that_were_flown_and_counts_each_once(run_cli, folder):
    with_track(trial.flown(folder / "runs", spec="turning_circle", name="circle"))
    with_track(folder / "runs/pulses_1.0.parquet")  # a track alone is no circle
    assert run_cli("identify", "--axis", "yaw", "--joint", "--effects", "servo_lag", "--no-figures").code == 0
    asked = ("turn-radius", "--speeds", "1.4", "--rudder-max", "0.35", "--method", "steady", "--no-figures", "--json")
    answer = run_cli(*asked)
    assert "joint_yaw.yaml -o turning --measured runs/circle.parquet\n" in answer.err
    (circle,) = answer.json["measured"]
    assert circle["run"] == "circle"
    others = ("runs/pulses_1.0.parquet", "runs/pulses_1.4.parquet")
    line = [w for run in others for w in ("--runs", run)]
    apart = run_cli(*asked, *line).json["measured"]
    assert apart == answer.json["measured"]


def test_live_takes_the_newest_run_and_what_the_plan_of_its_axis_promised(run_cli, folder):
    save_plan(plan_legs.plan(plan_legs.leg()), folder / "plan" / "plan.yaml", force=True)
    answer = run_cli("live", "--axis", "yaw", "--speed", "0")
    assert answer.code == 0, answer.err
    assert "taken from the trial folder: --plan plan/plan.yaml runs/pulses_1.4.parquet" in answer.err
    assert "goals: `plan/plan.yaml`" in answer.out
    stated = run_cli("live", "runs/pulses_1.0.parquet", "--axis", "yaw", "--speed", "0", "--want", "a22=9%")
    assert "taken from" not in stated.err


@pytest.mark.usefixtures("batch_here")
def test_batch_takes_the_logs_and_the_vehicle(run_cli, folder):
    body = run_cli("batch", "--axis", "yaw", "--no-diagnose", "--workers", "1", "--json")
    assert body.json["runs"] == 2
    assert "--vehicle vehicle.yaml" in body.err


def test_import_takes_the_logs_that_are_no_runs_yet_and_status_and_inspect_say_so(run_cli, folder):
    for run in sorted((folder / "runs").iterdir()):
        save_run(load_run(run), folder / "logs" / f"{run.stem}.csv")
        run.unlink()
    assert run_cli("status", "--json").json["next"]["command"] == "sysid import"
    assert run_cli("inspect", "logs/pulses_1.0.csv", "--json").json["headline"]["next"] == "sysid import"
    written = run_cli("inspect", "logs/pulses_1.0.csv", "--write-mapping", "mapping.yaml", "--force", "--json")
    assert written.json["headline"]["next"] == "sysid import"
    assert [r["run"] for r in run_cli("import", "logs/pulses_1.0.csv", "--json").json["runs"]] == ["pulses_1.0"]
    answer = run_cli("import", "--json")
    assert [r["run"] for r in answer.json["runs"]] == ["pulses_1.4"]
    assert "taken from the trial folder: -o runs logs/pulses_1.4.csv" in answer.err
    assert [r["run"] for r in run_cli("import", "--force", "--json").json["runs"]] == ["pulses_1.0", "pulses_1.4"]


def test_a_folder_of_the_tables_of_one_run_is_one_log(run_cli, folder):
    for run in [*(folder / "runs").iterdir()]:
        run.unlink()
    time = 0.1 * np.arange(300)
    tables = {"attitude": "yaw_rad,yaw_rate_rad_s", "speed": "surge_m_s,depth_m", "fin": "rudder_rad,thrust"}
    for size, run in (0.1, "one"), (0.2, "two"):
        (folder / "logs" / run).mkdir(parents=True)
        for name, columns in tables.items():
            rows = "".join(f"{t:.2f},{size * np.sin(t):.4f},{size * np.cos(t):.4f}\n" for t in time)
            (folder / "logs" / run / f"{name}.csv").write_text(f"time_s,{columns}\n{rows}")
    body = run_cli("status", "--json").json
    assert [f["path"] for f in body["files"] if f["kind"] == "log"] == ["logs/one", "logs/two"]
    assert body["next"]["command"] == "sysid import"
    assert run_cli("import").code == 0
    assert sorted(p.name for p in (folder / "runs").iterdir()) == ["one.parquet", "two.parquet"]


def test_a_log_from_elsewhere_is_imported_by_its_name(run_cli, folder):
    (folder / "runs/pulses_1.0.parquet").rename(folder.parent / "elsewhere.parquet")
    answer = run_cli("inspect", "../elsewhere.parquet", "--json")
    assert answer.json["headline"]["next"].startswith("sysid import ../elsewhere.parquet ")


def diagnosis(folder, runs, judges=(), effects=("servo_lag",)):
    """Write what a diagnosis of some runs says, and what judged."""
    lines = ["schema: fieldsid/diagnosis/1", "axis: yaw", f"effects: {json.dumps(list(effects))}"]
    lines += [f"{key}: {json.dumps(list(names))}" for key, names in (("runs", runs), ("validation_runs", judges))]
    (folder / "models/diagnosis_yaw.yaml").write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(
    ("gone", "judges", "taken"),
    [
        ((), (), BOTH_RUNS),
        ((), ("pulses_1.4",), (BOTH_RUNS[0], "--validate", BOTH_RUNS[1])),
        (("pulses_0.6",), ("pulses_1.4",), (BOTH_RUNS[0], "--validate", BOTH_RUNS[1])),
    ],
)
def test_extend_takes_the_runs_of_the_diagnosis_that_names_the_effect(run_cli, folder, gone, judges, taken):
    assert run_cli("identify", "runs/pulses_1.0.parquet", "--axis", "yaw", "--no-figures").code == 0
    diagnosis(folder, [r for r in ("pulses_1.0", "pulses_1.4", *gone) if r not in judges], judges)
    answer = run_cli("extend", "--add", "servo_lag")
    assert answer.code == 0
    command = journal(folder)[-1]["command"]
    assert command[4] == "models/pulses_1.0_yaw.yaml"
    assert tuple(command[5:]) == taken


def extended(folder, left):
    """Write a model extended from the joint one, whose record says what it leaves on the runs fitted to."""
    body = yaml.safe_load((folder / "models/joint_yaw.yaml").read_text())
    errors = {"angle_rms_rad": left * 0.005, "rate_rms_rad_s": left * 0.004}
    record = {
        "after": {"train": errors, "validation": dict.fromkeys(errors)},
        "noise_floor": {"angle_rad": 0.005, "rate_rad_s": 0.004},
    }
    parent = {"path": "models/joint_yaw.yaml", "sha256": sha256((folder / "models/joint_yaw.yaml").read_bytes()).hexdigest()}
    body |= {"parent": parent, "effects": ["servo_lag"], "info": body["info"] | {"extension": record}}
    (folder / "models/joint_yaw+servo_lag.yaml").write_text(yaml.safe_dump(body))


@pytest.mark.parametrize(
    ("left", "next_"),
    [
        (1.05, "sysid schedule design -o gains.yaml"),
        (2.31, "sysid diagnose --axis yaw --model models/joint_yaw+servo_lag.yaml"),
    ],
)
def test_status_goes_on_from_an_extended_model_as_extend_itself_does(run_cli, folder, left, next_):
    assert run_cli("identify", "--axis", "yaw", "--joint", "--no-figures").code == 0
    diagnosis(folder, ("pulses_1.0", "pulses_1.4"))
    extended(folder, left)
    assert run_cli("status", "--json").json["next"]["command"] == next_


def test_compare_asks_as_status_does_what_is_left_of_a_model_that_leaves_more_where_it_was_extended(run_cli, folder):
    assert run_cli("identify", "--axis", "yaw", "--joint", "--no-figures").code == 0
    trial.flown(folder / "runs", speed=1.2, name="pulses_1.2")
    model = "models/joint_yaw+servo_lag.yaml"
    for left, next_ in ((1.75, "sysid diagnose"), (1.05, "sysid turn-radius")):
        extended(folder, left)
        whole = yaml.safe_load((folder / model).read_text())
        (folder / model).write_text(yaml.safe_dump(whole | {"effects": []}))
        answer = run_cli("compare", model, "runs/pulses_1.2.parquet", "--no-figures")
        assert "nothing is left but the noise" in answer.out
        assert f"next: {next_}" in answer.out


def test_gains_of_a_model_that_was_extended_since_are_designed_again_verified_again_and_reported_again(run_cli, folder):
    assert run_cli("identify", "--axis", "yaw", "--joint", "--no-figures").code == 0
    diagnosis(folder, ("pulses_1.0", "pulses_1.4"), effects=())
    made_of = f"inputs:\n- path: models/joint_yaw.yaml\n  sha256: {stamped(folder, 'models/joint_yaw.yaml')}\n"
    row = {"speed_m_s": 1.0, "kp": -0.5, "ki": 0.0, "kd": -0.2, "feed_forward_rad": 0.0, "reference_gain": 0.0, "depth_gain": 0.0,
           "fin_limit_rad": 0.3, "supported": True, "slowed": 1.0, "phase_margin_deg": 60.0, "gain_margin_db": None,
           "delay_margin_s": 1.0, "draws_held": 1.0, "settling_s": 4.0}  # fmt: skip
    gains = {"axis": "yaw", "controller": "pd", "damping_ratio": 0.7, "phase_margin_wanted_deg": 45.0, "depth": False,
             "actuator": {}, "stated": {}, "rows": [row], "provenance": {}}  # fmt: skip
    (folder / "gains.yaml").write_text(f"schema: fieldsid/schedule/1\n{made_of}{to_yaml(gains)}")
    entries = iter(range(1, 9))

    def done(*command, inputs=(), outputs=()):
        ins, outs = (tuple(Stamp(f, stamped(folder, f), 0, 0) for f in files) for files in (inputs, outputs))
        append(folder, Entry(f"2027-01-01T00:00:0{next(entries)}+00:00", ("sysid", *command), 0, 1.0, "", ins, outs))

    def next_():
        return run_cli("status", "--json").json["next"]

    assert next_()["command"] == "sysid schedule verify"
    done("schedule", "verify", "gains.yaml", inputs=["gains.yaml"])
    assert next_()["command"] == "sysid report"
    done("report")
    assert next_()["command"] == ""
    extended(folder, 1.0)
    said = next_()
    assert said["why"] == "gains.yaml rests on models/joint_yaw.yaml, which was extended since"
    assert said["command"] == "sysid schedule design -o gains.yaml --force"
    text = (folder / "gains.yaml").read_text().replace("joint_yaw.yaml", "joint_yaw+servo_lag.yaml")
    old = stamped(folder, "models/joint_yaw.yaml")
    (folder / "gains.yaml").write_text(text.replace(old, stamped(folder, "models/joint_yaw+servo_lag.yaml")))
    assert next_()["command"] == "sysid schedule verify"
    done("schedule", "design", "-o", "gains.yaml", "--force", outputs=["gains.yaml"])
    done("schedule", "verify", "gains.yaml", inputs=["gains.yaml"])
    assert next_() == {
        "why": "the report is older than what `sysid schedule design` made",
        "command": "sysid report --force",
    }


def stamped(folder, name):
    return sha256((folder / name).read_bytes()).hexdigest()


def test_a_plan_is_written_where_live_finds_it_and_is_flown_next(run_cli, folder, monkeypatch):
    for run in (folder / "runs").iterdir():
        run.unlink()
    (folder / "plan").mkdir()
    (folder / "plan/plan.yaml").write_text("schema: fieldsid/plan/1\naxis: pitch\n")
    body = run_cli("status", "--json").json["next"]
    assert body["command"] == "sysid live --axis pitch --udp 14550"
    assert body["why"] == "there is no log yet: fly plan/plan.yaml and put the logs in logs/"
    filled = FILLS["plan"](parse(["plan", "--axis", "yaw", "--speeds", "1"]), state_of(folder))
    assert filled == ["-o", "plan-2"]


@pytest.mark.parametrize("line", [("schedule", "design"), ("fit",)])
def test_what_would_overwrite_a_file_is_refused_before_the_work(run_cli, folder, monkeypatch, line):
    assert run_cli("identify", "--axis", "yaw", "--no-figures").code == 0
    (folder / "out.yaml").write_text("mine")
    monkeypatch.setattr("fieldsid.plant.parameter_source.load_parameter_source", None)
    answer = run_cli(*line, "-o", "out.yaml")
    assert (answer.code, answer.err.splitlines()[-4:-2]) == (2, ["error: `out.yaml` exists", "  found: 4 bytes"])


def test_status_keeps_the_names_of_files_in_one_piece_and_says_which_command_of_several(run_cli, folder):
    name = "turning_circle_to_starboard"
    (folder / "runs/pulses_1.0.parquet").rename(folder / f"runs/{name}.parquet")
    append(folder, Entry("2026-01-01T00:00:00+00:00", ("sysid", "schedule", "verify", "gains.yaml"), 0, 1.0, "holds"))
    out = run_cli("status").out
    assert f"runs/{name}.parquet" in out
    assert "sysid schedule verify: holds" in out
