"""`sysid simulate`: a maneuver or a run's fin gives the model's own motion, as a run that other commands take."""

from __future__ import annotations

import numpy as np
import pytest
from cli import trial

from fieldsid.logs import load_run


def test_a_maneuver_becomes_a_run_that_gives_the_model_back(run_cli, tmp_path):
    out = tmp_path / "predicted.parquet"
    body = run_cli("simulate", trial.model_file(tmp_path), "--maneuver", "square_pulses", "-o", out, "--json").json
    assert body["schema"] == "fieldsid/simulation/1"
    assert body["file"] == str(out)
    (fit,) = run_cli("identify", out, "--axis", "yaw", "--json").json["fits"]
    for name, truth in trial.TRUTH["yaw"].items():
        assert fit["parameters"][name]["value"] == pytest.approx(truth, rel=1e-3)


def test_a_runs_fin_is_replayed(run_cli, tmp_path):
    run, out = trial.flown(tmp_path), tmp_path / "again.parquet"
    run_cli("simulate", trial.model_file(tmp_path), "--run", run, "-o", out, "--json")
    measured, again = load_run(run), load_run(out)
    np.testing.assert_allclose(again["rudder_rad"], measured["rudder_rad"])
    assert np.sqrt(np.mean((again["yaw_rate_rad_s"] - measured["yaw_rate_rad_s"]) ** 2)) < 0.006


def test_noise_from_one_seed_is_always_the_same(run_cli, tmp_path):
    model = trial.model_file(tmp_path)
    ends = [
        run_cli("simulate", model, "--maneuver", "doublet", "--noise", seed, "--json").json["signals"]["yaw_rad"]["end"]
        for seed in (1, 1, 2)
    ]
    assert ends[0] == ends[1] != ends[2]


@pytest.mark.parametrize("speed", ["0", "-1", "nan", "1000"])
def test_a_speed_that_no_vehicle_flies_at_is_refused_and_not_replaced(run_cli, tmp_path, speed):
    answer = run_cli("simulate", trial.model_file(tmp_path), "--maneuver", "doublet", "--speed", speed)
    assert answer.code == 2
    assert "cannot be right" in answer.err


def test_without_an_output_nothing_is_written(run_cli, tmp_path):
    model = trial.model_file(tmp_path)
    assert run_cli("simulate", model, "--maneuver", "doublet").code == 0
    assert [p.name for p in tmp_path.iterdir()] == ["truth.yaml"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "either a maneuver or a run"),
        (["--maneuver", "zigzig"], "did you mean `zigzag`"),
        (["--maneuver", "zigzag:amplitud=1"], "did you mean `amplitude`"),
        (["--maneuver", "zigzag", "--fin-max", "-1"], "fin limits must be above zero"),
        (["--maneuver", "zigzag", "-o", "motion.txt"], "cannot be written"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_a_hint(run_cli, tmp_path, arguments, says):
    answer = run_cli("simulate", trial.model_file(tmp_path), *arguments)
    assert answer.code == 2
    assert says in answer.err
    assert "\nhint: " in answer.err


def test_a_file_that_is_no_model_is_refused(run_cli, tmp_path):
    (tmp_path / "notes.yaml").write_text("hello: 1\n")
    answer = run_cli("simulate", tmp_path / "notes.yaml", "--maneuver", "zigzag")
    assert answer.code == 2
    assert "is not a fieldsid/model file" in answer.err
