"""`sysid live`: looks as JSON lines, a state that is gone on from, an exit code that says whether there was enough."""

from __future__ import annotations

import io
import json

import numpy as np
import plan_legs
import pytest
from cli import trial
from rich.console import Console

from fieldsid.cli.live.screen import screen
from fieldsid.fitting.identify import identify
from fieldsid.logs import load_run
from fieldsid.models.axis import Axis
from fieldsid.planning.output.plan_file import save_plan
from fieldsid.schedule.search.of_one_model import gains_of_one, usual


def looks(answer):
    return [json.loads(line) for line in answer.out.splitlines()]


def test_a_replayed_log_ends_near_the_truth_and_says_how_far_it_is(run_cli, tmp_path):
    answer = run_cli("live", trial.flown(tmp_path), "--axis", "yaw", "--speed", "0", "--json")
    assert answer.code == 0, answer.err
    found = looks(answer)
    assert found[0]["verdict"] == "starting"
    assert [b["share"] for b in found][-1] > 0.0
    last = found[-1]
    for name, truth in trial.TRUTH["yaw"].items():
        known = last["parameters"][name]
        assert abs(known["value"] - truth) < 4.0 * known["std_error"]
    assert last["next"].startswith("sysid identify ")


def test_without_a_terminal_it_prints_a_line_a_look_and_the_table_at_the_end(run_cli, tmp_path):
    answer = run_cli("live", trial.flown(tmp_path), "--axis", "yaw", "--speed", "0", "--every", "5")
    assert answer.code == 0
    assert "95 % band" in answer.out
    assert "next: sysid identify" in answer.out
    assert max(map(len, answer.out.split("\nnext: ")[1].splitlines()[1:6])) <= 80


def test_a_state_is_gone_on_from_and_ends_where_one_go_ends(run_cli, tmp_path):
    run = trial.flown(tmp_path)
    table = tmp_path / "run.csv"
    load_run(run)
    whole = looks(run_cli("live", run, "--axis", "yaw", "--speed", "0", "--json"))[-1]
    from fieldsid.logs import save_run

    log = load_run(run)
    half = float(log.time[len(log) // 2])
    save_run(log.between(0.0, half), table)
    state = tmp_path / "state.json"
    arguments = ("live", table, "--axis", "yaw", "--speed", "0", "--json", "--state", state)
    assert run_cli(*arguments).code == 0
    save_run(log, table, force=True)
    again = run_cli(*arguments)
    assert "going on from" in again.err
    last = looks(again)[-1]
    assert last["samples"] == whole["samples"]
    for name, known in whole["parameters"].items():
        assert last["parameters"][name]["value"] == pytest.approx(known["value"], rel=1e-9)
    other = run_cli("live", table, "--axis", "pitch", "--state", state, "--json")
    assert other.code == 2
    assert "is of yaw, not pitch" in other.err


def test_a_damaged_state_is_refused(run_cli, tmp_path):
    (tmp_path / "state.json").write_text('{"schema": "fieldsid/online/1", "state": {"version": 1}}')
    answer = run_cli("live", trial.flown(tmp_path), "--axis", "yaw", "--state", tmp_path / "state.json")
    assert answer.code == 2
    assert "is no state" in answer.err


def test_it_ends_at_enough_or_says_by_its_exit_code_that_there_was_not(run_cli, tmp_path):
    run = trial.flown(tmp_path, spec="square_pulses")
    easy = run_cli("live", run, "--axis", "yaw", "--speed", "0", "--want", "a22=50%,b2=50%", "--until-enough", "--json")
    assert easy.code == 0
    assert looks(easy)[-1]["verdict"] == "enough"
    hard = run_cli("live", run, "--axis", "yaw", "--speed", "0", "--want", "a22=0.01%", "--until-enough", "--json")
    assert hard.code == 1


def test_lines_on_standard_input_are_taken(run_cli, tmp_path, monkeypatch):
    log = load_run(trial.flown(tmp_path))
    lines = [
        json.dumps({"time_s": t, "rudder_rad": d, "yaw_rad": y, "yaw_rate_rad_s": r})
        for t, d, y, r in zip(log.time, log["rudder_rad"], log["yaw_rad"], log["yaw_rate_rad_s"], strict=True)
    ]
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO("\n".join(["rubbish", *lines]).encode())))
    last = looks(run_cli("live", "-", "--axis", "yaw", "--json"))[-1]
    assert last["counts"]["unreadable"] == 1
    assert last["samples"] > 0.9 * len(lines)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"\xff\n" + b"9" * 100_000 + b"\n" + "\n".join(lines).encode())))
    assert "2 lines could not be read" in run_cli("live", "-", "--axis", "yaw").out


def test_what_cannot_be_read_is_counted_where_nothing_follows_it(run_cli, monkeypatch):
    raw = b'{"time_s": 1, "rudder_rad": 0.1}\n\xff\n' + b"9" * 100_000
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(raw)))
    assert looks(run_cli("live", "-", "--axis", "yaw", "--json"))[-1]["counts"]["unreadable"] == 2


def test_the_goal_is_what_a_plan_promised(run_cli, tmp_path):
    file, leg = tmp_path / "plan.yaml", plan_legs.leg()
    save_plan(plan_legs.plan(leg), file)
    last = looks(run_cli("live", trial.flown(tmp_path), "--axis", "yaw", "--speed", "0", "--plan", file, "--json"))[-1]
    assert last["parameters"]["a22"]["goal_std_error"] == pytest.approx(leg.expected["a22"].std_error_high)
    assert file.name in last["goals_from"]
    wrong = run_cli("live", trial.flown(tmp_path, name="b"), "--axis", "pitch", "--plan", file)
    assert wrong.code == 2
    assert "the plan is for yaw, not pitch" in wrong.err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "either a log or `--udp PORT`"),
        (["run.csv", "--udp", "5005"], "either a log or `--udp PORT`"),
        (["--udp", "5005", "--follow"], "`--follow` needs a log"),
        (["nowhere.csv"], "there is no log"),
        (["nowhere.csv", "--plan", "p.yaml", "--want", "a22=5%"], "both say what is to be reached"),
    ],
)
def test_what_cannot_be_meant_is_said(run_cli, arguments, says):
    answer = run_cli("live", "--axis", "yaw", *arguments)
    assert answer.code == 2
    assert says in answer.err


def test_a_program_that_was_killed_and_goes_on_still_knows_that_the_numbers_have_settled(run_cli, tmp_path):
    run = trial.flown(tmp_path)
    said = ("live", run, "--axis", "yaw", "--speed", "0", "--state", tmp_path / "state", "--want", "a22=30%,b2=30%")
    first, again = run_cli(*said).out, run_cli(*said).out
    assert "enough data, come up" in first
    assert again.splitlines()[-7:] == first.splitlines()[-7:]
    assert again.splitlines()[0].split()[2] == "enough"


@pytest.mark.parametrize(("width", "has_band"), [(60, False), (90, True)])
def test_a_narrow_terminal_shows_every_name_and_goal(width, has_band):
    known = {"value": -1.19, "std_error": 0.04, "interval95": [-1.27, -1.11], "unit": "1/s^2"}
    known |= {"goal_std_error": 0.2, "settled": True}
    body = {
        "said": "enough data, come up", "verdict": "enough", "axis": "yaw", "samples": 644, "speed_m_s": 1.8,
        "goals_from": "`--want`", "parameters": {"a22": known, "b2": known}, "share": 1.0,
        "excitation": {"fin_rms_rad": 0.1, "rate_rms_rad_s": 0.1},
        "counts": {"unreadable": 0}, "authority_jump": None, "gains": None, "diagnosed": None,
    }  # fmt: skip
    to = Console(width=width, file=io.StringIO())
    to.print(screen(body))
    text = to.file.getvalue()
    assert "a22" in text
    assert "wanted" in text
    assert "\N{HORIZONTAL ELLIPSIS}" not in text
    assert ("95 % band" in text) is has_band


def test_gains_and_a_diagnosis_are_those_of_design_and_diagnose_once_a_maneuver_has_ended(run_cli, tmp_path):
    run = trial.flown(tmp_path, spec="square_pulses")
    said = ("live", run, "--axis", "yaw", "--speed", "0", "--json", "--every", "15", "--gains", "--diagnose")
    found = looks(run_cli(*said, "--want", "a22=30%,b2=30%"))
    assert found[0]["gains"]["verdict"] == "refused"
    last = found[-1]
    assert last["gains"]["verdict"] == "use"
    assert last["gains"]["row"]["kp"] * last["parameters"]["b2"]["value"] > 0.0
    (fit,) = identify([log := load_run(run)], Axis.YAW)
    row = gains_of_one(fit.model, last["gains"]["speed_m_s"], usual(float(np.abs(log["rudder_rad"]).max()), by_rate=True)).row
    assert last["gains"]["method"] == fit.model.method
    assert [last["gains"]["row"][name] for name in ("kp", "kd")] == pytest.approx([row.gains.kp, row.gains.kd], rel=1e-6)
    after = run_cli("diagnose", run, "--axis", "yaw", "--json").json
    for told in ("verdict", "effects", "left", "base", "final", "noise_floor", "next_maneuver"):
        assert last["diagnosed"][told] == after[told]
    assert after["short"] in last["diagnosed"]["says"]


def test_gains_of_lines_on_standard_input_are_of_all_that_was_sent(run_cli, tmp_path, monkeypatch):
    log = load_run(trial.flown(tmp_path))
    names = ("rudder_rad", "yaw_rad", "yaw_rate_rad_s")
    rows = zip(log.time, *(log[n] for n in names), strict=True)
    lines = [json.dumps(dict(zip(("time_s", *names, "surge_m_s"), (*row, 1.4), strict=True))) for row in rows]
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO("\n".join(lines).encode())))
    piped = looks(run_cli("live", "-", "--axis", "yaw", "--json", "--every", "15", "--gains"))[-1]["gains"]
    assert piped["method"] == "output_error"
    assert piped["time_s"] == pytest.approx(log.time[-1])


@pytest.mark.parametrize(
    ("more", "says"), [(["--depth", "--gains"], "depth is held through pitch"), (["--schedule", "no.yaml"], "no.yaml")]
)
def test_gains_that_cannot_be_meant_are_refused(run_cli, tmp_path, more, says):
    answer = run_cli("live", trial.flown(tmp_path), "--axis", "yaw", *more)
    assert answer.code == 2
    assert says in answer.err
