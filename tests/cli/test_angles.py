"""One way to type an angle in every command that takes one: with its unit, or in rad where the number can be."""

from __future__ import annotations

import numpy as np
import pytest
from cli import trial
from cli.test_fit import table
from truth.paper import YAW


@pytest.fixture
def asked(tmp_path):
    """Every option that takes an angle, as the words before its value."""
    made = table(tmp_path, rows=YAW[1:4:2])
    model = trial.model_file(tmp_path)
    plan = ("plan", "--speeds", "1.4", "--window", "22")
    return {
        "--max-heading": (*plan, "--max-heading"),
        "--max-pitch": (*plan, "--max-pitch"),
        "--max-roll": (*plan, "--max-roll"),
        "--fin-max": (*plan, "--fin-max"),
        "--fin-rate": (*plan, "--fin-rate"),
        "--rudder-max": ("turn-radius", made, "--rudder-max"),
        "--fin-zero": ("turn-radius", made, "--rudder-max", "15deg", "--fin-zero"),
        "--fin-limit": ("schedule", "design", made, "--fin-limit"),
        "schedule --fin-rate": ("schedule", "design", made, "--fin-limit", "15deg", "--fin-rate"),
        "simulate --fin-max": ("simulate", model, "--maneuver", "doublet", "--fin-max"),
    }


OPTIONS = (
    "--max-heading", "--max-pitch", "--max-roll", "--fin-max", "--fin-rate", "--rudder-max", "--fin-zero", "--fin-limit",
    "schedule --fin-rate", "simulate --fin-max",
)  # fmt: skip


@pytest.mark.parametrize("option", OPTIONS)
def test_a_bare_number_that_cannot_be_rad_is_refused_with_both_readings(run_cli, asked, option):
    answer = run_cli(*asked[option], "60")
    assert (answer.code, answer.out) == (2, "")
    assert "60 deg or 60 rad?" in answer.err
    assert "60 deg is 1.047 rad, 60 rad is 3438 deg" in answer.err


@pytest.mark.parametrize("option", OPTIONS)
def test_what_cannot_be_meant_with_its_unit_is_refused_too(run_cli, asked, option):
    answer = run_cli(*asked[option], "5000deg")
    assert (answer.code, answer.out) == (2, "")
    assert "5000" in answer.err
    assert "if it is in degrees" not in answer.err


def test_degrees_and_radians_mean_the_same(run_cli, asked):
    rad, deg = "0.2617993877991494", "15deg"
    for option, typed in (("--fin-limit", (rad, deg)), ("--rudder-max", (rad, deg)), ("simulate --fin-max", (f"{rad}rad", deg))):
        one, two = (
            {k: v for k, v in run_cli(*asked[option], a, "--json").json.items() if k != "headline"}  # it repeats what was typed
            for a in typed
        )
        assert str(one) == str(two)


def test_an_angle_inside_a_maneuver_is_typed_the_same_way(run_cli, tmp_path):
    said = ("simulate", trial.model_file(tmp_path), "--maneuver")
    assert run_cli(*said, "zigzag:amplitude=0.2rad,turn=10deg").code == 0
    answer = run_cli(*said, "zigzag:turn=20")
    assert answer.code == 2
    assert "20deg`, or `20rad` where that is meant" in answer.err
    assert run_cli(*said, "square_pulses:width=2deg").code == 2


def test_a_negative_tolerance_is_refused(run_cli, asked):
    assert "lies in 0 .. 45 deg" in run_cli(*asked["--fin-zero"], "-1deg").err


def test_a_margin_is_typed_with_its_unit_or_in_deg_and_never_guessed(run_cli, asked):
    said = (*asked["--fin-limit"], "15deg", "--phase-margin")
    one, two, three = (run_cli(*said, text, "--json").json["rows"] for text in ("40", "40deg", f"{np.radians(40.0):.15g}rad"))
    assert one == two
    assert [r["kp"] for r in three] == pytest.approx([r["kp"] for r in one])
    for refused in ((*said, "0.7"), ("schedule", "verify", "gains.yaml", "--require-phase-margin", "0.7")):
        answer = run_cli(*refused)
        assert answer.code == 2
        assert "0.7 rad is 40.11 deg" in answer.err
        assert "40deg`" in answer.err


def test_a_course_and_a_fin_rate_take_the_same_angles(run_cli, asked):
    answer = run_cli(*asked["--max-heading"], "60deg", "--course", "90")
    assert answer.code == 2
    assert "write `--course 90deg`\n" in answer.err
    assert "write at most `--course 360deg`" in run_cli(*asked["--max-heading"], "60deg", "--course", "400deg").err


@pytest.mark.parametrize(
    ("option", "value"),
    [("--fin-rate", "0"), ("--fin-rate", "-1deg"), ("--fin-lag", "-1"), ("--delay", "-1"), ("--latency", "nan")],
)
def test_a_fin_that_cannot_be_is_refused(run_cli, asked, option, value):
    answer = run_cli(*asked["--fin-limit"], "15deg", option, value)
    assert answer.code == 2
    assert "must be a number" in answer.err
