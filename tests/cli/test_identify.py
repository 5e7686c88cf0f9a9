"""`sysid identify`: the numbers of a known vehicle come back, files and figures are written whole, bad input is refused."""

from __future__ import annotations

import hashlib
import os

import pytest
from cli import trial

import fieldsid as fs
from fieldsid.comparison.sufficient import over_noise
from fieldsid.fitting.estimates import Estimate
from fieldsid.logs import save_run
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import load_model


@pytest.mark.parametrize("axis", list(Axis))
def test_the_numbers_of_a_known_vehicle_come_back_within_their_intervals(run_cli, tmp_path, axis):
    run = trial.flown(tmp_path, axis)
    body = run_cli("identify", run, "--axis", axis, "--json").json
    (fit,) = body["fits"]
    assert body["schema"] == "fieldsid/identify/1"
    assert fit["model"] is None
    for name, truth in trial.TRUTH[axis].items():
        found = fit["parameters"][name]
        assert abs(found["value"] - truth) < 3.5 * found["std_error"]
        low, high = found["interval95"]
        assert low < found["value"] < high


@pytest.mark.parametrize("axis", list(Axis))
def test_the_axis_may_be_left_out_where_the_run_excites_one_alone(run_cli, tmp_path, axis):
    run = trial.flown(tmp_path, axis)
    asked, told = (run_cli("identify", run, *axis_given, "--json").json for axis_given in ((), ("--axis", axis)))
    assert (asked["axis"], asked["fits"]) == (told["axis"], told["fits"])


def test_runs_that_excite_both_axes_are_refused_without_one(run_cli, tmp_path):
    answer = run_cli("identify", *(trial.flown(tmp_path, axis, name=str(axis)) for axis in Axis))
    assert answer.code == 2
    assert "yaw in 1 of 2, pitch in 1 of 2" in answer.err
    assert "--axis yaw" in answer.err


def test_the_fin_offset_follows_from_trim_and_authority(run_cli, tmp_path):
    (fit,) = run_cli("identify", trial.flown(tmp_path), "--axis", "yaw", "--json").json["fits"]
    p = fit["parameters"]
    assert p["delta_r0"]["value"] == pytest.approx(p["C0"]["value"] / p["b2"]["value"])
    assert p["delta_r0"]["unit"] == "rad"


def test_model_and_figure_are_written_beside_each_other_and_the_log_is_untouched(run_cli, tmp_path):
    run = trial.flown(tmp_path)
    before = run.read_bytes()
    body = run_cli("identify", run, "--axis", "yaw", "-o", tmp_path / "models", "--json").json
    assert sorted(p.name for p in (tmp_path / "models").iterdir()) == ["run7_yaw.png", "run7_yaw.yaml", "run7_yaw_residuals.png"]
    assert body["fits"][0]["model"] == str(tmp_path / "models" / "run7_yaw.yaml")
    assert run.read_bytes() == before
    text = (tmp_path / "models" / "run7_yaw.yaml").read_text()
    assert hashlib.sha256(before).hexdigest() in text


def test_the_model_file_holds_what_was_printed(run_cli, tmp_path):
    body = run_cli("identify", trial.flown(tmp_path), "--axis", "yaw", "-o", tmp_path, "--no-figures", "--json").json
    model = load_model(tmp_path / "run7_yaw.yaml")
    for name, value in model.values.items():
        assert body["fits"][0]["parameters"][name]["value"] == pytest.approx(value)
    assert not list(tmp_path.glob("*.png"))


def test_an_existing_model_is_kept_unless_forced(run_cli, tmp_path):
    run = trial.flown(tmp_path)
    (tmp_path / "run7_yaw.yaml").write_text("mine")
    answer = run_cli("identify", run, "--axis", "yaw", "-o", tmp_path, "--no-figures")
    assert answer.code == 2
    assert "add `--force`" in answer.err
    assert (tmp_path / "run7_yaw.yaml").read_text() == "mine"
    assert run_cli("identify", run, "--axis", "yaw", "-o", tmp_path, "--no-figures", "--force").code == 0


def test_several_speeds_make_one_joint_model(run_cli, tmp_path):
    runs = [trial.flown(tmp_path, speed=u, seed=i, name=f"v{u}") for i, u in enumerate((1.0, 1.4, 1.8))]
    body = run_cli("identify", *runs, "--axis", "yaw", "--joint", "-o", tmp_path, "--no-figures", "--json").json
    (fit,) = body["fits"]
    assert [r["run"] for r in fit["runs"]] == ["v1.0", "v1.4", "v1.8"]
    assert (tmp_path / "joint_yaw.yaml").is_file()


def test_the_parameters_of_a_joint_fit_are_printed_with_the_speed_they_belong_to(run_cli, tmp_path):
    runs = [trial.flown(tmp_path, speed=u, seed=i, name=f"v{u}") for i, u in enumerate((1.0, 1.4, 1.8))]
    first = run_cli("identify", runs[1], "--axis", "yaw").out
    joint = run_cli("identify", *runs, "--axis", "yaw", "--joint").out
    named = [[line[len(label) :].split()[0] for line in trial.below(text) if "+/-" in line]
             for text, label in ((first, "v1.4"), (joint, "3 runs"))]  # fmt: skip
    assert named[0] == ["a22", "b2", "C0", "delta_r0"]
    assert named[1] == ["a22@1.4", "b2@1.4", "C0", "damping_exponent", "b2@1", "b2@1.8", "delta_r0@1.4"]


def test_two_files_of_one_name_are_told_apart_by_their_folders(run_cli, tmp_path):
    runs = []
    for seed, folder in enumerate(("a", "b")):
        (tmp_path / folder).mkdir()
        runs.append(trial.flown(tmp_path / folder, seed=seed))
    body = run_cli("identify", *runs, "--axis", "yaw", "--json").json
    assert [f["run"] for f in body["fits"]] == ["a_run7", "b_run7"]


def test_two_legs_of_one_log_have_a_model_each_and_the_same_leg_twice_is_refused(run_cli, tmp_path):
    log = trial.flown(tmp_path)
    legs = [tmp_path / "legs" / name for name in ("out.parquet", "back.parquet")]
    for leg, part in zip(legs, (["--to", 17], ["--from", 16]), strict=True):
        assert run_cli("import", log, *part, "-o", leg).code == 0
    asked = ["--axis", "yaw", "-o", tmp_path / "m", "--no-figures", "--json"]
    body = run_cli("identify", *legs, *asked).json
    assert [f["run"] for f in body["fits"]] == ["out", "back"]
    assert sorted(p.name for p in (tmp_path / "m").iterdir()) == ["back_yaw.yaml", "out_yaw.yaml"]
    answer = run_cli("identify", legs[0], legs[1], legs[0], *asked, "--force")
    assert answer.code == 2
    assert f"`{legs[0]}` is given twice" in answer.err


def test_text_fits_eighty_columns_and_says_that_nothing_was_kept(run_cli, tmp_path):
    answer = run_cli("identify", trial.flown(tmp_path), "--axis", "yaw")
    assert max(map(len, trial.below(answer.out))) <= 80
    assert "+/-" in answer.out
    assert answer.out.splitlines()[2].endswith(" --axis yaw -o models/")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--axis", "roll"], "invalid value"),
        (["--axis", "pitch"], "no fin signal for pitch"),
        (["--axis", "yaw", "--method", "output_eror"], "did you mean `output_error`"),
        (["--axis", "yaw", "--effects", "servolag"], "did you mean `servo_lag`"),
        (["--axis", "yaw", "--effects", "roll_coupling"], "roll_coupling needs roll"),
        (["--axis", "yaw", "--from", "500"], "no samples between"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_a_hint(run_cli, tmp_path, arguments, says):
    answer = run_cli("identify", trial.flown(tmp_path), *arguments)
    assert (answer.code, answer.out) == (2, "")
    assert says.lower() in answer.err.lower()
    assert "\nhint: " in answer.err


def test_a_missing_file_is_named(run_cli, tmp_path):
    answer = run_cli("identify", tmp_path / "nothing.csv", "--axis", "yaw")
    assert answer.code == 2
    assert "nothing.csv" in answer.err


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser writes everywhere")
def test_a_folder_that_cannot_be_written_is_refused(run_cli, tmp_path):
    run = trial.flown(tmp_path)
    tmp_path.chmod(0o500)
    assert run_cli("identify", run, "--axis", "yaw", "-o", tmp_path / "models").code == 2


def test_it_says_why_auto_took_its_method_where_it_had_to_choose(run_cli, tmp_path):
    run = trial.flown(tmp_path, hidden=("servo_lag", {"lag": 0.4}))
    answer = run_cli("identify", run, "--axis", "yaw")
    (fit,) = run_cli("identify", run, "--axis", "yaw", "--json").json["fits"]
    assert fit["method"] == "output_error"
    assert fit["method_reason"].startswith("`auto` took output error: what prediction error leaves follows fin and motion")
    assert fit["method_reason"] in answer.out
    (fit,) = run_cli("identify", run, "--axis", "yaw", "--method", "output_error", "--json").json["fits"]
    assert fit["method_reason"] is None


def test_of_many_runs_those_that_the_model_follows_least_are_drawn(run_cli, tmp_path, monkeypatch):
    most = 2
    monkeypatch.setattr("fieldsid.cli.commands.identify.MOST_DRAWN", most)
    runs = [trial.flown(tmp_path, seed=i, name=f"n{i}") for i in range(most + 2)]
    bent = trial.flown(tmp_path, speed=1.9, seed=77, name="bent")
    answer = run_cli("identify", *runs, bent, "--axis", "yaw", "--joint", "-o", tmp_path / "models")
    assert answer.code == 0
    drawn = {p.name for p in (tmp_path / "models").glob("*.png")}
    assert len(drawn) == 2 * most
    assert f"of the {most} runs it follows least" in answer.out
    body = run_cli("identify", *runs, bent, "--axis", "yaw", "--joint", "--json").json["fits"][0]
    over = {r["run"]: over_noise(r, body["noise_floor"]) for r in body["runs"]}
    least = sorted(over, key=lambda run: -over[run])[:most]
    assert {f"joint_yaw_{run}.png" for run in least} < drawn


def test_a_sensor_that_no_run_has_has_no_noise_floor(run_cli, tmp_path):
    (whole,) = fs.load(trial.flown(tmp_path))
    signals = {name: whole[name] for name in ("yaw_rad", "rudder_rad", "surge_m_s")}
    run = save_run(Run("angle", whole.time, signals), tmp_path / "angle.parquet")
    (fit,) = run_cli("identify", run, "--axis", "yaw", "-o", tmp_path, "--no-figures", "--json").json["fits"]
    (compared,) = run_cli("compare", fit["model"], run, "--json").json["runs"]
    for found in (fit, compared):
        assert found["rate_rms_rad_s"] is None
        assert found["noise_floor"]["rate_rad_s"] is None
        assert found["noise_floor"]["angle_rad"] > 0.0


def test_the_interval_of_a_lag_ends_where_a_lag_may():
    assert Estimate("lag", 0.006, 0.004, "s", (0.0, 2.0)).interval95 == (0.0, pytest.approx(0.006 + 1.96 * 0.004, rel=1e-3))
    assert Estimate("a22", 0.006, 0.004, "1/s").interval95[0] < 0.0
