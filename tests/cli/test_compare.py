"""`sysid compare`: the contract's numbers, the figure, the gate, and bad input."""

from __future__ import annotations

import os
from hashlib import sha256

import numpy as np
import pytest
from cli import trial
from truth.logbook import flown, write_csv
from truth.maneuvers import zigzag
from truth.noise import Clock
from truth.physics import Physics

from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model


def test_the_model_that_made_a_run_is_down_to_its_noise(run_cli, tmp_path):
    asked = ("compare", trial.model_file(tmp_path), trial.flown(tmp_path, spec="zigzag"))
    body = run_cli(*asked, "--json").json
    (run,) = body["runs"]
    assert body["schema"] == "fieldsid/compare/1"
    assert run["rate_rms_rad_s"] == pytest.approx(0.004, rel=0.1)
    assert run["angle_rms_rad"] == pytest.approx(0.005, rel=0.1)
    assert 0.0 <= run["theil"] <= 1.0
    assert run["r2"] <= 1.0
    assert (run["failing"], run["where"], run["worst"], run["moves_with"]) == ([], [], [], [])
    text = run_cli(*asked).out
    assert f"run7: down to the noise, {run['over_noise']:.2f} x: " in text
    assert "fails" not in text
    assert "worst" not in text
    assert "missing moment" not in text


@pytest.fixture
def drifting(tmp_path):
    """A model whose trim is off: the rate is followed tolerably, the angle it adds up to is not."""
    return save_model(trial.vehicle(Axis.YAW, C0=0.05), tmp_path / "drifting.yaml")


def test_the_channel_that_fails_worse_leads_the_text_and_the_json_and_both_are_there(run_cli, tmp_path, drifting):
    log = trial.flown(tmp_path, spec="zigzag")
    (run,) = run_cli("compare", drifting, log, "--json").json["runs"]
    assert run["angle_fit_percent"] < 0.0
    assert run["rate_fit_percent"] > 50.0
    assert (run["judged_by"], list(run["over_floor"])) == ("angle", ["angle", "rate"])
    assert [f["channel"] for f in run["failing"]] == ["angle", "rate"]
    assert run["where"] == run["failing"][0]["where"] != run["failing"][1]["where"]
    assert run["worst"] == run["failing"][0]["worst"]
    assert {"condition", "share_of_error", "rms_ratio", "t_start_s", "t_end_s"} <= set(run["where"][0])
    text = run_cli("compare", drifting, log).out
    assert 0 < text.index(f"where the angle fails, {run['over_floor']['angle']:.1f} x") < text.index("where the rate fails")


def test_the_gate_sees_the_angle_too(run_cli, tmp_path, drifting):
    answer = run_cli("compare", drifting, trial.flown(tmp_path, spec="zigzag"), "--min-fit", 30)
    assert answer.code == 1
    assert "gate failed: run7 has angle fit -" in answer.err
    assert "has rate fit" not in answer.err


def test_what_a_log_rounds_between_its_samples_is_said_with_the_error_as_logged(run_cli, tmp_path):
    fast = Clock(0.005, 8000)
    log = flown(Physics(damping=1.1, authority=-1.2), fast, zigzag(fast.time, 0.26, 0.4), angle_noise=0.0004, rate_noise=0.0004)
    rounded = write_csv({name: values[::20] for name, values in log.items() if name != "surge_m_s"}, tmp_path / "rounded.csv")
    model = save_model(trial.vehicle(Axis.YAW, C0=0.0), tmp_path / "hull.yaml")
    (run,) = run_cli("compare", model, rounded, "--json").json["runs"]
    times = run["command_times"]
    assert times["jumps"] >= 4
    assert 0.0 < times["largest_s"] <= 0.1
    assert run["rate_rms_rad_s"] < 0.5 * times["as_logged"]["rate_rms_rad_s"]
    assert f"{times['jumps']} jumps of the command" in " ".join(run_cli("compare", model, rounded).out.split())
    exact = run_cli("compare", trial.model_file(tmp_path), trial.flown(tmp_path, spec="zigzag"), "--json").json["runs"][0]
    assert exact["command_times"] is None


def test_a_speed_that_is_a_little_off_is_said_with_the_error_as_logged(run_cli, tmp_path):
    clock = Clock(0.05, 1200)
    hull = Physics(damping=1.1, authority=-1.2, nominal_speed=1.4)
    log = flown(hull, clock, zigzag(clock.time, 0.26, 0.8), angle_noise=0.002, rate_noise=0.002)
    slow = write_csv(log | {"surge_m_s": np.full(clock.time.size, 1.4 / 1.006)}, tmp_path / "slow.csv")
    model = save_model(trial.vehicle(Axis.YAW, C0=0.0), tmp_path / "hull.yaml")
    (run,) = run_cli("compare", model, slow, "--json").json["runs"]
    assert run["own_speed"]["faster"] == pytest.approx(0.006, abs=0.0015)
    assert run["angle_rms_rad"] < 0.8 * run["own_speed"]["as_logged"]["angle_rms_rad"]
    assert "% faster than the 1.392 m/s" in " ".join(run_cli("compare", model, slow).out.split())


def test_one_figure_per_run_is_drawn_beside_each_other(run_cli, tmp_path):
    runs = [trial.flown(tmp_path, spec="zigzag", seed=k, name=n) for k, n in enumerate(("one", "two"))]
    body = run_cli("compare", trial.model_file(tmp_path), *runs, "-o", tmp_path / "out", "--json").json
    assert [r["figure"] for r in body["runs"]] == [str(tmp_path / "out" / f"truth_on_{n}.png") for n in ("one", "two")]
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["truth_on_one.png", "truth_on_two.png"]


@pytest.mark.parametrize(("least", "code"), [(50, 0), (99.9, 1)])
def test_a_gate_that_fails_is_exit_one_with_the_numbers_printed_all_the_same(run_cli, tmp_path, least, code):
    answer = run_cli("compare", trial.model_file(tmp_path), trial.flown(tmp_path), "--min-fit", least)
    assert answer.code == code
    assert "run7" in answer.out
    assert ("gate failed: run7" in answer.err) is bool(code)


def test_text_fits_eighty_columns(run_cli, tmp_path):
    out = run_cli("compare", trial.model_file(tmp_path), trial.flown(tmp_path)).out
    assert max(map(len, trial.below(out))) <= 80


def test_a_run_of_the_other_axis_is_refused(run_cli, tmp_path):
    answer = run_cli("compare", trial.model_file(tmp_path, Axis.PITCH), trial.flown(tmp_path, Axis.YAW))
    assert answer.code == 2
    assert "no fin signal for pitch" in answer.err


def test_a_model_that_was_searched_in_vain_is_not_sent_to_the_same_search_again(run_cli, tmp_path, drifting):
    log = trial.flown(tmp_path, spec="zigzag")
    asked = ("compare", drifting, log, "--quiet")
    assert run_cli(*asked).out.splitlines()[2].startswith("next: sysid diagnose ")
    digest = sha256(drifting.read_bytes()).hexdigest()
    diagnosis = tmp_path / "diagnosis_yaw.yaml"
    held = f"schema: fieldsid/diagnosis/1\ninputs:\n- path: drifting.yaml\n  sha256: {digest}\neffects: "
    diagnosis.write_text(f"{held}[]\n")
    assert run_cli(*asked).out.splitlines()[2].startswith("next: sysid turn-radius ")
    diagnosis.write_text(f"{held}[servo_lag]\n")
    assert run_cli(*asked).out.splitlines()[2].startswith("next: sysid diagnose ")
    diagnosis.write_text(f"{held}[]\n")
    os.utime(diagnosis, (1.0, 1.0))  # older than the model
    assert run_cli(*asked).out.splitlines()[2].startswith("next: sysid diagnose ")
