"""The commands on third-party logs: numbers that independent fits give, at several speeds, and where the model fails."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.field
SPEEDS = ("1.00", "1.50", "1.90")


def test_yaw_at_one_speed_agrees_with_an_independent_fit(run_cli, shared_data):
    (fit,) = run_cli("identify", shared_data / "lauv/rudder_v1.50.csv.gz", "--axis", "yaw", "--json").json["fits"]
    p = fit["parameters"]
    assert p["a22"]["value"] == pytest.approx(2.28, rel=0.02)
    assert p["b2"]["value"] == pytest.approx(-3.09, rel=0.02)
    assert p["a22"]["interval95"][0] < 2.28 < p["a22"]["interval95"][1]
    assert fit["rate_fit_percent"] == pytest.approx(92.0, abs=1.0)


def test_yaw_authority_grows_with_speed(run_cli, shared_data):
    runs = [shared_data / f"lauv/rudder_v{v}.csv.gz" for v in SPEEDS]
    fits = run_cli("identify", *runs, "--axis", "yaw", "--json").json["fits"]
    authority = [f["parameters"]["b2"]["value"] for f in fits]
    assert authority == sorted(authority, reverse=True)
    assert all(f["rate_fit_percent"] > 88 for f in fits)


def test_pitch_at_three_speeds_agrees_with_independent_fits(run_cli, shared_data):
    runs = [shared_data / f"lauv/elevator_v{v}.csv.gz" for v in SPEEDS]
    fits = run_cli("identify", *runs, "--axis", "pitch", "--json").json["fits"]
    damping = [f["parameters"]["c22"]["value"] for f in fits]
    authority = [f["parameters"]["d2"]["value"] for f in fits]
    assert 2.2 < min(damping) <= max(damping) < 2.7
    assert authority[0] == pytest.approx(-1.56, rel=0.03)
    assert authority[-1] == pytest.approx(-4.75, rel=0.03)


def test_the_pulses_model_is_seen_to_fail_at_the_onset_of_a_zigzag(run_cli, shared_data, tmp_path):
    lauv = shared_data / "lauv"
    (fit,) = run_cli("identify", lauv / "rudder_v1.50.csv.gz", "--axis", "yaw", "-o", tmp_path, "--no-figures", "--json").json[
        "fits"
    ]
    (run,) = run_cli("compare", fit["model"], lauv / "zigzag_v1.50.csv.gz", "--json").json["runs"]
    assert run["rate_rms_rad_s"] > 2 * run["noise_floor"]["rate_rad_s"]
    (rate,) = (fault for fault in run["failing"] if fault["channel"] == "rate")
    (onset,) = [w for w in rate["where"] if w["condition"] == "phase: onset"]
    assert onset["rms_ratio"] > 1.5
