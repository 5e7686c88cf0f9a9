"""One log that cannot be used never stops the others: it is skipped with its reason, and the exit code is 1."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from cli import trial

import fieldsid
from fieldsid.fitting.identify import identify
from fieldsid.logs import load_run, save_run
from fieldsid.models.axis import Axis


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    folder = tmp_path_factory.mktemp("good")
    return [trial.flown(folder, speed=u, seed=i, name=f"v{u}") for i, u in enumerate((1.2, 1.6))]


def still(folder, like):
    """A run whose rudder never moves."""
    run = load_run(like)
    signals = {**run.signals, "rudder_rad": np.full(len(run), 0.01)}
    return save_run(replace(run, signals=signals), folder / "still.parquet")


def cut(folder):
    path = folder / "cut.csv"
    path.write_text("time_s,yaw_rad,rudder_rad\n")
    return path


@pytest.fixture
def bad(tmp_path, good):
    return [cut(tmp_path), still(tmp_path, good[0])]


def skipped_in(answer):
    assert answer.code == 1, answer.err
    return json.loads(answer.out)["skipped_runs"]


@pytest.mark.parametrize("joint", [[], ["--joint"]])
def test_identify_fits_the_others_and_lists_what_it_skipped(run_cli, good, bad, tmp_path, joint):
    answer = run_cli("identify", bad[0], *good, bad[1], "--axis", "yaw", "-o", tmp_path / "m", "--no-figures", "--json", *joint)
    skipped = skipped_in(answer)
    assert [(s["run"], s["file"]) for s in skipped] == [("cut", str(bad[0])), ("still", str(bad[1]))]
    assert all(s["what"] and s["found"] and s["hint"] for s in skipped)
    assert [f["run"] for f in json.loads(answer.out)["fits"]] == (["v1.2+v1.6"] if joint else ["v1.2", "v1.6"])
    written = sorted(p.name for p in (tmp_path / "m").iterdir())
    assert written == (["joint_yaw.yaml"] if joint else ["v1.2_yaw.yaml", "v1.6_yaw.yaml"])
    assert answer.err.count("skipped `") == 2
    assert "2 of 4 logs skipped" in answer.err


def test_a_joint_fit_of_which_one_run_is_left_is_refused(run_cli, good, bad, tmp_path):
    for unfit in bad:
        answer = run_cli("identify", good[0], unfit, "--axis", "yaw", "--joint", "-o", tmp_path / "m")
        assert answer.code == 2
        assert "a joint fit needs two runs, and 1 of 2 can be used" in answer.err
        assert f"skipped `{unfit}`" in answer.err
        assert "leave `--joint` out" in answer.err
    assert not (tmp_path / "m").exists()


def test_where_no_run_is_left_the_exit_code_is_two_and_each_reason_is_said(run_cli, good, bad, tmp_path):
    other = still(tmp_path / "b", good[1])
    answer = run_cli("identify", bad[1], other, "--axis", "yaw", "--json")
    assert answer.code == 2
    assert '"schema": "fieldsid/error/1"' in answer.out
    assert "no log is left that can be used" in answer.err
    assert answer.err.count("never leaves its trim") == 2
    alone = run_cli("identify", bad[1], "--axis", "yaw")
    assert alone.code == 2
    assert "skipped" not in alone.err


def test_what_is_wrong_for_all_runs_stops_at_once(run_cli, good):
    for wrong in (["--method", "output_eror"], ["--effects", "servolag"], ["-m", "no.yaml"]):
        answer = run_cli("identify", *good, "--axis", "yaw", *wrong)
        assert (answer.code, "skipped" in answer.err) == (2, False)


def test_a_run_without_a_signal_that_an_effect_needs_is_skipped(run_cli, good, tmp_path):
    run = load_run(good[0])
    roll = 0.1 * np.sin(run.time)
    rolling = save_run(replace(run, signals={**run.signals, "roll_rad": roll}), tmp_path / "rolling.parquet")
    answer = run_cli("identify", rolling, good[1], "--axis", "yaw", "--effects", "roll_coupling", "--json")
    (skipped,) = skipped_in(answer)
    assert skipped["found"] == "roll_coupling needs roll, which the log lacks (v1.6)"


def test_compare_goes_on_with_the_others(run_cli, good, bad, tmp_path):
    model = trial.model_file(tmp_path)
    blind = save_run(
        replace(load_run(good[0]), signals={"rudder_rad": load_run(good[0])["rudder_rad"]}), tmp_path / "blind.parquet"
    )
    answer = run_cli("compare", model, bad[0], good[0], blind, "--json")
    assert [s["run"] for s in skipped_in(answer)] == ["cut", "blind"]
    assert [r["run"] for r in json.loads(answer.out)["runs"]] == ["v1.2"]


def test_diagnose_and_extend_go_on_with_the_others_but_not_without_a_run_to_judge_by(run_cli, good, bad, tmp_path):
    model = tmp_path / "m" / "v1.2_yaw.yaml"
    assert run_cli("identify", good[0], "--axis", "yaw", "-o", tmp_path / "m", "--no-figures").code == 0
    commands = {
        "diagnose": ["--axis", "yaw"],
        "extend": ["--add", "servo_lag", "--keep"],
    }
    for name, options in commands.items():
        first = [model] if name == "extend" else []
        answer = run_cli(name, *first, good[0], bad[1], *options, "--validate", good[1], "--validate", bad[0], "--json")
        assert [s["run"] for s in skipped_in(answer)] == ["cut", "still"]
        answer = run_cli(name, *first, good[0], good[1], *options, "--validate", bad[1], "--json", "--force")
        assert answer.code == 2
        assert '"schema": "fieldsid/error/1"' in answer.out
        assert "still" in answer.err
    assert "still" not in (tmp_path / "m" / "v1.2_yaw+servo_lag.yaml").read_text()


def test_the_function_raises_where_nobody_asks_to_be_told(good, bad):
    runs = [load_run(good[0]), load_run(bad[1])]
    told: list[str] = []
    (fit,) = identify(runs, Axis.YAW, unfit=lambda run, error: told.append(f"{run.name}: {error.what}"))
    assert fit.model.runs == ("v1.2",)
    assert len(told) == 1
    with pytest.raises(Exception, match="never leaves its trim"):
        identify(runs, Axis.YAW)


def circle(folder):
    """A run of a turn to starboard with its positions."""
    run = load_run(trial.flown(folder, spec="turning_circle", name="turn"))
    step = np.diff(run.time, prepend=run.time[0])
    track = {"x_m": np.cumsum(1.4 * np.cos(run["yaw_rad"]) * step), "y_m": np.cumsum(1.4 * np.sin(run["yaw_rad"]) * step)}
    return save_run(replace(run, signals={**run.signals, **track}), folder / "circle.parquet")


def test_turn_radius_goes_on_without_the_circle_and_the_run_it_cannot_use(run_cli, good, bad, tmp_path):
    model = trial.model_file(tmp_path)
    asked = ["turn-radius", model, "--rudder-max", 0.3, "--speeds", 1.4, "--json"]
    answer = run_cli(*asked, "--measured", good[0], "--measured", circle(tmp_path), "--runs", bad[0], "--runs", good[1])
    assert [s["run"] for s in skipped_in(answer)] == ["cut", "v1.2"]
    assert [m["run"] for m in json.loads(answer.out)["measured"]] == ["circle"]
    assert run_cli(*asked, "--measured", good[0]).code == 2


def test_a_run_of_a_model_that_cannot_be_read_again_does_not_end_its_turn_radius(run_cli, tmp_path, caplog):
    log = trial.flown(tmp_path)
    asked = ["identify", log, "--axis", "yaw", "--effects", "servo_lag", "-o", tmp_path, "--no-figures"]
    assert run_cli(*asked).code == 0
    log.write_text("")
    answer = run_cli("turn-radius", tmp_path / "run7_yaw.yaml", "--rudder-max", 0.3, "--json")
    assert answer.code == 0
    assert json.loads(answer.out)["skipped_runs"] == []
    unread = f"cannot be read again: `{log}`; `--runs` takes others"
    assert unread in answer.err
    with caplog.at_level("INFO", "fieldsid"):
        fieldsid.turn_radius(tmp_path / "run7_yaw.yaml", rudder_max=0.3)
    assert unread in caplog.text
