"""`sysid schedule` as a user meets it: design, verify with gates, export to files and into one that exists."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import pytest
from cli import trial
from cli.test_fit import table
from truth.paper import PITCH, YAW

from fieldsid.cli.app import main
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.rounding import number


@pytest.fixture(scope="module")
def designed(tmp_path_factory):
    """The folder of a table and of the gains made of it."""
    folder = tmp_path_factory.mktemp("designed")
    of = table(folder, rows=YAW[1:4:2])
    assert main(["schedule", "design", str(of), "--fin-limit", "0.26", "--fin-lag", "0.2", "-o", str(folder / "gains.yaml")]) == 0
    return folder


@pytest.fixture
def gains(designed, tmp_path):
    """A copy of them for one test."""
    for name in ("yaw.csv", "gains.yaml"):
        (tmp_path / name).write_text((designed / name).read_text().replace(str(designed), str(tmp_path)))
    return tmp_path / "gains.yaml"


def test_design_prints_the_papers_gains(run_cli, tmp_path):
    body = run_cli("schedule", "design", table(tmp_path), "--fin-limit", "0.26", "--damping", "0.7", "--json").json
    row = body["rows"][2]
    assert body["schema"] == "fieldsid/schedule/1"
    assert row["kp"] == pytest.approx(1.01**2 / (4 * 0.49 * -1.04), rel=1e-6)
    assert row["feed_forward_rad"] == pytest.approx(-0.0081 / 1.04)
    assert body["provenance"]["models"][0]["sha256"]


def test_the_helps_own_example_counts_with_the_servo_of_the_models(run_cli, tmp_path):
    paths = []
    for speed in (1.0, 1.8):
        model = trial.vehicle(Axis.YAW, "servo_lag", a22=0.8 * speed, b2=-0.6 * speed**2, lag=0.3)
        paths.append(save_model(replace(model, law=SpeedLaw(speed)), tmp_path / f"m{speed}.yaml"))
    law = tmp_path / "law.yaml"
    assert run_cli("fit", *paths, "-o", law, "--no-figures").code == 0
    body = run_cli("schedule", "design", law, "--fin-limit", "0.26", "--json").json
    assert body["actuator"]["lag_s"] == 0.3
    assert "counted with: lag 0.300 s, delay 0 s" in run_cli("schedule", "design", law, "--fin-limit", "0.26").out
    bare = " ".join(run_cli("schedule", "design", table(tmp_path), "--fin-limit", "0.26").out.split())
    assert "counted with: lag 0 s, delay 0 s, no rate limit; no run to measure the speed lost in the turn: 15 % assumed" in bare
    assert "a table carries no effects" in bare
    rows = run_cli("turn-radius", law, "--rudder-max", "0.2", "--json").json["rows"]
    assert {r["method"] for r in rows} == {"simulated"}


def test_verify_passes_by_its_gates(run_cli, gains, tmp_path):
    good = run_cli("schedule", "verify", gains, "--require-phase-margin", "40", "--max-overshoot", "30", "-o", tmp_path / "g.png")
    assert good.code == 0, good.err
    assert "passed: phase_margin_deg" in good.out
    assert (tmp_path / "g.png").is_file()


def test_verify_begins_with_its_verdict_and_what_that_rests_on(run_cli, gains):
    body = run_cli("schedule", "verify", gains, "--json").json
    lines = run_cli("schedule", "verify", gains).out.splitlines()
    assert body["verdict"] == "holds"
    assert lines[0] == f"holds: {body['says']}"
    assert f"{body['worst']['phase_margin_deg']:.1f} deg" in lines[0]
    begun = lines[1].removesuffix(" ...")
    assert body["rests_on"].startswith(begun)
    assert lines[1].startswith("rests on yaw.csv with no effects; ")
    assert "lag 0.200 s" in lines[1]
    table_at = next(i for i, line in enumerate(lines) if line.startswith("deg, dB, s of margin"))
    assert table_at > 1


def test_a_gate_that_fails_stands_first_with_its_number_and_speed(run_cli, gains):
    answer = run_cli("schedule", "verify", gains, "--require-phase-margin", "75", "--max-overshoot", "90")
    first = answer.out.splitlines()[0]
    body = json.loads(run_cli("schedule", "verify", gains, "--require-phase-margin", "75", "--json").out)
    (gate,) = body["gates"]
    assert (body["verdict"], gate["passed"], answer.code) == ("FAILED", False, 1)
    assert first == (
        f"FAILED: phase_margin_deg {number(gate['found'], 3)} at {number(gate['speed_m_s'], 3)} m/s, wanted at least 75"
    )
    assert "passed: overshoot_percent" in answer.out
    assert body["worst"]["phase_margin_deg"] == min(c["phase_margin_least_deg"] for c in body["scheduled"])


def test_a_step_that_does_not_settle_is_no_schedule_that_holds(run_cli, gains, tmp_path):
    weak = tmp_path / "weak.yaml"
    weak.write_text(re.sub(r"kp: (\S+)", r"kp: -0.001", gains.read_text()))
    first = run_cli("schedule", "verify", weak).out.splitlines()[0]
    assert first.startswith("does not hold: at ")
    assert "a 5 deg step is not within 5 % after 240 s" in first


def test_verify_says_when_the_models_are_gone(run_cli, gains, tmp_path):
    (tmp_path / "yaw.csv").rename(tmp_path / "moved.csv")
    answer = run_cli("schedule", "verify", gains)
    assert answer.code == 2
    assert "--model" in answer.err
    assert run_cli("schedule", "verify", gains, "--model", tmp_path / "moved.csv").code == 0


def test_export_prints_or_writes_and_refuses_an_unknown_target(run_cli, gains, tmp_path):
    printed = run_cli("schedule", "export", gains, "--to", "ros2")
    assert "ros__parameters:" in printed.out
    assert "next: " not in printed.out  # what is redirected to a file is the file
    assert printed.err.splitlines()[0] == f"{gains} as ros2, on standard output"
    assert printed.err.splitlines()[2].endswith(f"--to ros2 -o {gains.stem}_ros2.yaml")
    assert run_cli("schedule", "export", gains, "--to", "dune", "-o", tmp_path / "g.ini").code == 0
    assert "[Control." in (tmp_path / "g.ini").read_text()
    answer = run_cli("schedule", "export", gains, "--to", "ross")
    assert answer.code == 2
    assert "ros2" in answer.err


def test_export_into_shows_first_and_writes_only_when_told(run_cli, gains, tmp_path):
    config = tmp_path / "vehicle_config.yaml"
    config.write_text("# mine\ncontrol:\n  heading: {}\n  other: 1  # stays\n")
    shown = run_cli("schedule", "export", gains, "--into", config, "--key", "control.heading")
    assert shown.code == 0
    assert "+    kp: [" in shown.out
    assert "nothing was changed" in shown.err.splitlines()[0]
    assert shown.err.splitlines()[2].endswith(" --write")
    assert config.read_text().endswith("heading: {}\n  other: 1  # stays\n")
    assert run_cli("schedule", "export", gains, "--into", config, "--key", "control.heading", "--write").code == 0
    assert "# stays" in config.read_text()
    assert "kp: [" in config.read_text()
    assert (tmp_path / "vehicle_config.yaml.bak").read_text().startswith("# mine")


def test_a_file_that_an_export_replaces_is_shown_and_kept(run_cli, gains, tmp_path):
    own = tmp_path / "uuv.params"
    own.write_text("1\t1\tUUV_YAW_P\t4.0\t9\n")
    assert run_cli("schedule", "export", gains, "--to", "px4", "-o", own).code == 2
    assert not (tmp_path / "uuv.params.bak").exists()
    answer = run_cli("schedule", "export", gains, "--to", "px4", "-o", own, "--force")
    assert answer.code == 0
    assert "-1\t1\tUUV_YAW_P\t4.0\t9" in answer.out
    assert "as it was: " in answer.out
    assert (tmp_path / "uuv.params.bak").read_text() == "1\t1\tUUV_YAW_P\t4.0\t9\n"
    assert run_cli("schedule", "export", gains, "--to", "px4").out == own.read_text()
    again = run_cli("schedule", "export", gains, "--to", "px4", "-o", own, "--force", "--json")
    assert json.loads(again.out)["difference"] == ""
    assert not (tmp_path / "uuv.params.bak2").exists()


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("--settling=0.5s", "no gains settle a 20 deg step within 0.5 s"),
        ("--settling=soon", "`--settling` must be a number, in `s` or `ms`"),
        ("--bandwidth=50", "no gains have a bandwidth of 50 rad/s"),
        ("--overshoot=0.2", "is 0.2 % or 20 %"),
        ("--fin-use=300%", "the share of the fin must lie in 1 .. 100 %"),
        ("--latency=20s", "`--latency` must be a number, 0 to 10 s"),
    ],
)
def test_a_wish_that_cannot_be_had_is_refused_with_a_hint(run_cli, tmp_path, option, said):
    answer = run_cli("schedule", "design", table(tmp_path, rows=YAW[1:4:2]), "--fin-limit", "0.26", "--controller", "pd", option)
    assert answer.code == 2
    assert said in answer.err
    assert "hint: " in answer.err


def test_gains_that_fail_between_their_rows_lead_to_closer_ones_that_hold(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = "1.0,1.2,0.3,-0.5,0.03\n1.4,1.7,0.3,-1.0,0.03\n1.8,2.2,0.3,-1.65,0.03\n"
    (tmp_path / "pitch.csv").write_text(f"speed_m_s,c22,c23,d2,Cb\n{rows}")
    asked = ("--depth", "--controller", "pd", "--step", "5deg", "--fin-max", "0.25")
    designed = run_cli("schedule", "design", "pitch.csv", *asked, "-o", "gains.yaml")
    assert designed.code == 0, designed.err
    next_ = run_cli("schedule", "verify", "gains.yaml", "--json").json["headline"]["next"].split()
    assert next_[1:3] == ["schedule", "design"]
    assert next_[4:13] == [*asked, "--speeds", "1.00,1.20,1.40,1.80"]
    assert run_cli(*next_[1:]).code == 0
    assert run_cli("schedule", "verify", next_[-1], "--json").json["verdict"] == "holds"


def test_export_into_needs_a_key_that_is_there(run_cli, gains, tmp_path):
    config = tmp_path / "vehicle_config.yaml"
    config.write_text("control: {heading: 1}\n")
    assert run_cli("schedule", "export", gains, "--into", config).code == 2
    answer = run_cli("schedule", "export", gains, "--into", config, "--key", "control.headin")
    assert answer.code == 2
    assert "heading" in answer.err


def test_a_fin_limit_below_the_offset_and_none_at_all_are_refused(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "below the offset" in run_cli("schedule", "design", table(tmp_path), "--fin-limit", "0.01").err
    assert "--fin-max 0.26" in run_cli("schedule", "design", table(tmp_path)).err


def test_depth_goes_through_pitch(run_cli, tmp_path):
    of, path = table(tmp_path, "pitch", rows=PITCH[1:4:2]), tmp_path / "pitch_gains.yaml"
    fin = ("--fin-limit", "0.26", "--fin-lag", "0.2")
    answer = run_cli("schedule", "design", of, *fin, "--controller", "pd", "--depth", "-o", path)
    assert answer.code == 0, answer.err
    assert "depth step of 2 m" in run_cli("schedule", "verify", path).out
