"""What cannot be meant is refused by the option that was typed, with a hint that works; nothing of it is a bug of the program."""

from __future__ import annotations

import shlex

import pytest
from cli.test_fit import table

PLAN = ("plan", "--axis", "yaw", "--speeds", "1.4")


@pytest.mark.parametrize(
    ("words", "says", "hint"),
    [
        ("--fin-max 0", "`--fin-max` must be above zero", "the vehicle's own limit, else 0.26 rad"),
        ("--fin-max -3deg", "`--fin-max` must be above zero", "`--fin-max 15deg`"),
        ("--fin-max 0.001deg", "turns no vehicle", "`--fin-max 15deg`"),
        ("--fin-rate 0", "`--fin-rate` must be above zero", "`--fin-rate 60deg`"),
        ("--area 0x50", "`--area` must be above zero", "`--area 200x60`"),
        ("--area 50x-5", "`--area` must be above zero", "`--area 200x60`"),
        ("--max-heading 0", "`--max-heading` must be above zero", "`--max-heading none`"),
        ("--max-track nan", "`--max-track` must be above zero", "`--max-track 20`"),
        ("--risk 0", "`--risk` must be above zero", "no maneuver is without risk"),
        ("--window 1e6", "a window of 1e+06 s", "`--window 33`"),
        ("--window nan", "a window of nan s", "`--window 33`"),
        ("--seed -1", "a seed is a whole number from zero", "`--seed 1`"),
    ],
)
def test_a_plan_that_cannot_be_meant_names_the_option_and_what_leaving_it_out_means(run_cli, words, says, hint):
    answer = run_cli(*PLAN, *shlex.split(words))
    assert answer.code == 2
    assert says in answer.err
    assert hint in " ".join(answer.err.split())


@pytest.mark.parametrize(
    ("words", "says", "hint"),
    [
        ("--rudder-max 0", "above 0 and at most at 90 deg", "--fin-max 15deg"),
        ("--rudder-max 0.26 --speeds 100", "a speed of 100 m/s cannot be right", "0.01 to 15"),
        ("--rudder-max 0.26 --speeds 1e-9", "a speed of 1e-09 m/s cannot be right", "0.01 to 15"),
        ("--rudder-max 0.26 --law b2=nan", "not a law of numbers", "`--law a22=1`"),
        ("--rudder-max 0.26 --law a22=1e308,1e308", "not a law of numbers", "`--law a22=1`"),
    ],
)
def test_a_turn_that_cannot_be_meant_is_refused(run_cli, tmp_path, words, says, hint):
    answer = run_cli("turn-radius", table(tmp_path), *shlex.split(words))
    assert answer.code == 2
    assert says in answer.err
    assert hint in " ".join(answer.err.split())


@pytest.mark.parametrize(
    ("words", "says", "hint"),
    [
        ("--fin-rate 0", "`--fin-rate` must be a number, above zero", "`--fin-rate 60deg`"),
        ("--fin-lag 200", "`--fin-lag` must be a number, 0 to 10 s", "`--fin-lag 0.2` is 200 ms"),
        ("--latency -1", "`--latency` must be a number, 0 to 10 s", "`--latency 0.1` is 100 ms"),
        ("--delay inf", "`--delay` must be a number, in `s` or `ms`", "`--delay 0.1s`"),
        ("--phase-margin nan", "'nan' is not an angle", "15deg"),
        ("--law b2=inf", "not a law of numbers", "`--law a22=1`"),
        ("--speeds 1000", "a speed of 1000 m/s cannot be right", "0.01 to 15"),
    ],
)
def test_gains_that_cannot_be_meant_are_refused(run_cli, tmp_path, words, says, hint):
    answer = run_cli("schedule", "design", table(tmp_path), "--fin-limit", "0.26", *shlex.split(words), "-o", tmp_path / "g.yaml")
    assert answer.code == 2
    assert says in answer.err
    assert hint in " ".join(answer.err.split())
    assert not (tmp_path / "g.yaml").exists()


def test_a_schedule_whose_loop_never_crosses_unity_is_read_back(run_cli, tmp_path):
    rows = "1.0,0.86,0.5,-0.41,0.03\n1.4,1.2,0.5,-0.8,0.03\n1.8,1.54,0.5,-1.32,0.03\n"
    (tmp_path / "pitch.csv").write_text(f"speed_m_s,c22,c23,d2,Cb\n{rows}")
    slow = ("--fin-limit", "0.18", "--controller", "pd", "--step", "4deg", "-o", tmp_path / "g.yaml")
    answer = run_cli("schedule", "design", tmp_path / "pitch.csv", *slow, "--json")
    assert answer.code == 0, answer.err
    assert any(row["phase_margin_deg"] is None for row in answer.json["rows"])
    assert run_cli("schedule", "export", tmp_path / "g.yaml", "--to", "yaml").code == 0
