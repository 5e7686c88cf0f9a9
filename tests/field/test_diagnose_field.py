"""Diagnose, extend and history on third-party logs: the error falls on runs that were not fitted, as far as is known there."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.field
SENSOR_RATE = 0.0035
"""Yaw-rate noise of the logs in rad/s, from their description."""


@pytest.fixture(scope="module")
def lauv(shared_data):
    return shared_data / "lauv"


@pytest.mark.slow
def test_a_vehicle_with_a_fin_lag_sway_and_nonlinear_damping_is_not_called_sufficient(run_cli, lauv):
    asked = ("diagnose", lauv / "rudder_v1.50.csv.gz", "--axis", "yaw", "--validate", lauv / "zigzag_v1.50.csv.gz")
    body = run_cli(*asked, "--json").json
    assert body["verdict"] != "sufficient"
    assert "servo_lag" in body["candidates"][0]["effect"]
    assert body["noise_floor"]["rate_rad_s"] == pytest.approx(SENSOR_RATE, rel=0.15)
    assert body["base"]["validation"]["rate_rms_rad_s"] > 2 * SENSOR_RATE
    assert body["candidates"][0]["validation"]["rate_rms_rad_s"] < 0.7 * body["base"]["validation"]["rate_rms_rad_s"]
    assert body["candidates"][0]["explained"] > 0.5


@pytest.mark.slow
def test_the_error_on_zigzags_falls_with_each_of_the_effects_that_are_there(run_cli, lauv, tmp_path):
    runs = [lauv / f"rudder_v{v}.csv.gz" for v in ("1.00", "1.50", "1.90")]
    unseen = [part for v in ("1.00", "1.90") for part in ("--validate", lauv / f"zigzag_v{v}.csv.gz")]
    (fit,) = run_cli("identify", *runs, "--axis", "yaw", "--joint", "-o", tmp_path, "--no-figures", "--json").json["fits"]
    model = fit["model"]
    for effect in ("servo_lag", "quadratic_damping"):
        body = run_cli("extend", model, *runs, "--add", effect, *unseen, "--json").json
        assert body["kept"], effect
        model = body["model"]
    line = run_cli("history", model, "--json").json["generations"]
    errors = [line[1]["over_floor"]["before"], *(g["over_floor"]["after"] for g in line[1:])]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.75 * errors[0]


@pytest.mark.slow
def test_what_is_applied_ends_at_the_error_that_was_named_and_the_error_falls_on_the_way(run_cli, lauv, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runs = [lauv / f"elevator_v{v}.csv.gz" for v in ("1.00", "1.50")]
    asked = ("diagnose", *runs, "--axis", "pitch", "--validate", lauv / "elevator_v1.90.csv.gz", "--apply", "--json")
    body = run_cli(*asked).json
    steps = body["applied"]
    assert {step["effect"] for step in steps} == set(body["effects"])
    for channel in ("angle_rms_rad", "rate_rms_rad_s"):
        assert steps[-1]["after"]["validation"][channel] < 1.1 * body["final"]["validation"][channel]
    assert all(step["pays"] for step in steps)


def test_zigzags_of_every_speed_are_predicted_down_to_the_noise_by_what_pulses_taught(run_cli, lauv, tmp_path):
    speeds = ("1.00", "1.25", "1.50", "1.70", "1.90")
    pulses, zigzags = ([lauv / f"{kind}_v{v}.csv.gz" for v in speeds] for kind in ("rudder", "zigzag"))
    asked = ("--effects", "servo_lag,quadratic_damping,speed_varying", "--joint", "--no-figures", "-o", tmp_path)
    (fit,) = run_cli("identify", *pulses, "--axis", "yaw", *asked, "--json").json["fits"]
    runs = run_cli("compare", fit["model"], *zigzags, "--json").json["runs"]
    assert [r["run"] for r in runs if r["rate_rms_rad_s"] > 1.3 * SENSOR_RATE] == []
    timed = [r["command_times"] for r in runs if r["command_times"]]
    assert len(timed) >= 3
    assert all(t["as_logged"]["rate_rms_rad_s"] > 1.5 * SENSOR_RATE for t in timed)
    assert all(t["command_times"] is None for t in run_cli("compare", fit["model"], *pulses, "--json").json["runs"])
