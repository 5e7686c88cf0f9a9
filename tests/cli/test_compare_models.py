"""`sysid compare` without runs, and with several models: before against after, and which model follows best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cli import trial

from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise, save_model
from fieldsid.models.speed_law import SpeedLaw


def saved(path, *, b2=-1.2, error=0.01, axis=Axis.YAW, effects=(), **values):
    base = {"a22": 1.1, "b2": b2, "C0": 0.02} if axis is Axis.YAW else {"c22": 1.4, "c23": 0.4, "d2": 1.3, "Cb": 0.02}
    free = tuple(base)
    law = SpeedLaw(1.4, trim_of_fin=axis is Axis.YAW)
    trained = {"speed_low": 1.4, "speed_high": 1.4, "fin_max": 0.26, "rate_max": 0.3}
    covariance = np.diag([(error * abs(base[n])) ** 2 for n in free])
    model = Model(axis, effects, base | values, {}, free, covariance, law, Noise(0.005, 0.004), trained=trained, runs=("run7",))
    path.parent.mkdir(parents=True, exist_ok=True)
    return save_model(model, path)


def test_one_line_says_what_changed_and_what_follows(run_cli, tmp_path):
    before, after = saved(tmp_path / "old.yaml"), saved(tmp_path / "new.yaml", b2=-1.2 * 0.82)
    answer = run_cli("compare", before, after, "-o", tmp_path)
    assert answer.code == 0, answer.err
    first, second, third = answer.out.splitlines()[:3]
    assert first == "yaw authority -18.0 +/- 1.2 %, damping unchanged: new gains needed"
    assert second.startswith("rests on 1 model file before, 1 after, at 1.40 m/s; 3 tests at once")
    assert third == f"next: sysid schedule design {after} -o gains_after.yaml"
    assert "turning radius in m at 0.26 rad" in answer.out
    assert (tmp_path / "before_after_yaw.png").read_bytes()[:4] == b"\x89PNG"


def test_json_holds_every_number_and_two_folders_do_as_well(run_cli, tmp_path):
    saved(tmp_path / "a" / "models" / "m.yaml")
    saved(tmp_path / "a" / "models" / "p.yaml", axis=Axis.PITCH)
    saved(tmp_path / "b" / "m.yaml", b2=-1.2, error=0.011)
    saved(tmp_path / "b" / "p.yaml", axis=Axis.PITCH, d2=1.8)
    body = run_cli("compare", tmp_path / "a", tmp_path / "b", "--json").json
    assert body["schema"] == "fieldsid/compare-models/1"
    yaw, pitch = body["changes"]
    assert (yaw["verdict"], pitch["verdict"]) == ("hold", "needed")
    assert pitch["parameters"][0]["change"] == pytest.approx(1.8 / 1.3 - 1)
    assert yaw["next"] is None


def test_a_model_beside_itself_is_refused(run_cli, tmp_path):
    one = saved(tmp_path / "old.yaml")
    (tmp_path / "copy.yaml").write_bytes(one.read_bytes())
    answer = run_cli("compare", one, tmp_path / "copy.yaml")
    assert answer.code == 2
    assert "the models of both sides are the same" in answer.err


def test_two_models_of_one_run_are_said_to_be_that(run_cli, tmp_path):
    run = trial.flown(tmp_path)
    for method in ("output_error", "svf_ls"):
        asked = ("identify", run, "--axis", "yaw", "--method", method, "-o", tmp_path / method, "--no-figures")
        assert run_cli(*asked).code == 0
    answer = run_cli("compare", tmp_path / "output_error", tmp_path / "svf_ls")
    assert answer.code == 0
    assert "both sides were fitted to run7.parquet" in answer.err


def test_the_gate_and_the_mapping_are_for_runs(run_cli, tmp_path):
    answer = run_cli("compare", saved(tmp_path / "a.yaml"), saved(tmp_path / "b.yaml", error=0.02), "--min-fit", 90)
    assert answer.code == 2
    assert "are for runs" in answer.err


def test_several_models_over_runs_say_which_follows_best_and_which_has_seen_them(run_cli, tmp_path):
    run = trial.flown(tmp_path, spec="zigzag")
    good, bad = trial.model_file(tmp_path), saved(tmp_path / "off.yaml", b2=-1.0)
    body = run_cli("compare", bad, good, run, "--json").json
    assert body["schema"] == "fieldsid/compare-several/1"
    assert body["best"] == str(good)
    assert [m["over_floor"] > 1.5 for m in body["models"]] == [True, False]
    assert body["models"][0]["fitted_to"] == ["run7"]
    answer = run_cli("compare", bad, good, run, "-o", tmp_path / "figures")
    assert answer.out.startswith("truth follows best: 1.0")
    assert "off was fitted to run7: no fair judge of it" in answer.out
    assert (tmp_path / "figures" / "models_on_run7.png").is_file()


def test_two_alike_are_called_alike(run_cli, tmp_path):
    run, one = trial.flown(tmp_path, spec="zigzag"), trial.model_file(tmp_path)
    two = save_model(replace(trial.vehicle(Axis.YAW), method="again"), tmp_path / "again.yaml")
    assert " follows no better than the next: " in run_cli("compare", one, two, run).out


def test_three_models_without_a_run_are_refused(run_cli, tmp_path):
    answer = run_cli("compare", *(saved(tmp_path / f"{n}.yaml") for n in "abc"))
    assert answer.code == 2
    assert "several models are compared over runs" in answer.err


def test_a_run_of_the_same_name_from_another_day_judges_a_model_that_has_not_seen_it(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for seed, day in ((3, "before"), (4, "after")):
        trial.flown(tmp_path / day / "runs", seed=seed, name="run7")
        assert run_cli("identify", f"{day}/runs/run7.parquet", "--axis", "yaw", "-o", day, "--no-figures").code == 0
    models = [f"{day}/run7_yaw.yaml" for day in ("before", "after")]
    body = run_cli("compare", *models, "after/runs/run7.parquet", "--json").json
    assert [m["fitted_to"] for m in body["models"]] == [[], ["run7"]]
    alone = run_cli("compare", models[0], "after/runs/run7.parquet", "--json").json
    assert [r["fitted_to"] for r in alone["runs"]] == [False]
    body = run_cli("compare", models[1], f"{tmp_path}/after/run7_yaw.yaml", "after/runs/run7.parquet", "--json").json
    assert body["headline"]["rests_on"].endswith("; every one was fitted to run7: no fair judge")
