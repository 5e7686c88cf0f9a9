"""`sysid demo`: every step runs, says what it means, and leaves its files; nothing of the user's is replaced."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from guide.session import TOUR

from fieldsid.cli.commands import demo
from fieldsid.demo import steps, vehicle
from fieldsid.demo.steps import PLAN, STEPS, Step
from fieldsid.demo.vehicle import SPEED, SPEED_NOISE, flown, hidden_vehicle
from fieldsid.logs import load_run
from fieldsid.maneuvers import all_maneuvers, pick_maneuver
from fieldsid.planning import request
from fieldsid.planning.design.leg import commands_of
from fieldsid.planning.output.plan_file import load_plan
from fieldsid.rounding import number


@pytest.fixture(scope="module")
def tour(guide_session):
    """The tour taken once, as its JSON object; the guide's pages show the same."""
    return guide_session.bodies[TOUR]


@pytest.fixture(scope="module")
def folder(guide_session, tour):
    """The folder that the tour filled."""
    return guide_session.folder / tour["folder"]


def test_the_tour_is_told_on_one_screen_and_ends_with_the_report(tour, folder):
    pairs = zip((PLAN, *STEPS), tour["steps"], strict=True)
    told = "".join(f"{i:2d}. {step.title} {step.tells(s['result'])[0]}\n" for i, (step, s) in enumerate(pairs, 1))
    assert sum(1 + len(line) // 80 for line in told.splitlines()) <= 30
    assert tour["steps"][-1]["command"] == f"sysid report {tour['folder']}"
    assert (folder / "report.html").is_file()
    assert "servo_lag, probability 0.99" in told


@pytest.mark.parametrize("name", sorted(all_maneuvers()))
def test_the_vehicle_flies_any_maneuver_that_the_plan_may_choose(name):
    maneuver = pick_maneuver(name)
    run = flown(hidden_vehicle("heave_coupling"), maneuver, SPEED, 1, parameters=maneuver.checked({}))
    assert np.isfinite(run["pitch_rate_rad_s"]).all()


def test_a_step_that_cannot_use_all_logs_ends_the_tour_with_its_command(run_cli, tmp_path, monkeypatch):
    monkeypatch.setattr(demo, "run", lambda *_asked: 1)
    answer = run_cli("demo", "-o", tmp_path / "a")
    assert answer.code == 2
    assert "the tour ends at its step 1, which could not use all logs" in answer.err
    assert f"`sysid plan --axis yaw --speeds 1.4 --fin-rate 1.5 --write csv -o {tmp_path}/a/plan` ended" in answer.err


@pytest.fixture
def planned(folder, monkeypatch):
    """Let `sysid plan` answer with the tour's own plan: the search for it is nothing that is told here."""
    plan = load_plan(folder / "plan" / "plan.yaml")
    monkeypatch.setattr(request, "make_plan", lambda *_asked: plan)


def test_briefly_each_command_is_a_line_and_verbosely_all_that_it_says(run_cli, tmp_path, monkeypatch, planned, guide_session):
    few = tuple(s for s in STEPS if s.line.split()[0] in {"inspect", "import"})
    monkeypatch.setattr(steps, "STEPS", few)
    brief = run_cli("demo", "-o", tmp_path / "a")
    assert brief.code == 0
    assert " 3. From log to run: 5 runs: SI and radians, one clock\n" in brief.out
    assert "$ sysid" not in brief.out
    verbose = guide_session.run(TOUR)
    assert "\n3. From log to run\n$ sysid import demo/trial/*.csv" in verbose
    assert "=> Each log is now a run" in verbose


def test_a_quiet_tour_ends_with_its_headline_alone(run_cli, tmp_path, monkeypatch, planned):
    monkeypatch.setattr(steps, "STEPS", ())
    answer = run_cli("demo", "-o", tmp_path / "tour", "--quiet")
    verdict, rests_on, then = answer.out.splitlines()
    assert verdict.startswith("hidden in the trial was servo_lag")
    assert rests_on.startswith("rests on ")
    assert then.startswith("next: sysid ")


def results_of(tour, command):
    return [s["result"] for s in tour["steps"] if s["command"].split()[1] == command]


def test_every_step_runs_and_leaves_files_and_figures(tour):
    assert tour["schema"] == "fieldsid/demo/1"
    assert [s["command"].split()[1] for s in tour["steps"]] == [s.line.split()[0] for s in (PLAN, *STEPS)]
    assert all(s["means"] for s in tour["steps"])
    names = {Path(f).name for f in tour["files"]}
    assert {"plan.yaml", "plan.png", "diagnosis.png", "history.png", "turn_radius.png", "gains.png", "heading_ros2.yaml"} <= names


def test_the_tour_begins_with_a_plan_that_says_what_it_buys_and_the_vehicle_flies_it(tour, folder):
    first = tour["steps"][0]
    (leg,) = first["result"]["legs"]
    assert leg["expected"]["a22"]["relative"] < 0.05
    assert f"a22 to {100 * leg['expected']['a22']['relative']:.1f} %" in first["means"]
    plan = load_plan(folder / "plan" / "plan.yaml")
    run = load_run(folder / "runs" / f"learn_{SPEED:.1f}.parquet")
    _, fin, autopilot = commands_of(plan.legs[0], plan.envelope)
    about_trim = run["rudder_rad"] - run["rudder_rad"][0]
    assert len(run) == fin.size
    # the logger writes the fin to a thousandth of a degree
    assert np.abs(about_trim - fin)[autopilot == 0].max() < 1e-4
    assert run["surge_m_s"].mean() == pytest.approx(SPEED, abs=SPEED_NOISE)


def test_the_planned_run_buys_what_the_plan_says_once_the_effect_is_in_the_model(tour):
    promised = tour["steps"][0]["result"]["legs"][0]["expected"]["a22"]["relative"]
    (fitted,) = (s["result"] for s in tour["steps"] if "/speeds" in s["command"] and s["command"].split()[1] == "identify")
    (planned,) = (f for f in fitted["fits"] if f["run"] == f"learn_{SPEED:.1f}")
    a22 = planned["parameters"]["a22"]
    assert a22["std_error"] / a22["value"] <= promised


def test_the_hidden_effect_is_named_and_its_strength_comes_back(tour):
    assert tour["hidden"]["effect"] == demo.HIDDEN
    assert tour["named"] == [demo.HIDDEN]
    (extended,) = results_of(tour, "extend")
    for name, found in extended["coefficients"].items():
        assert found["value"] == pytest.approx(tour["hidden"]["values"][name], abs=5 * found["std_error"])


def test_the_error_on_unseen_runs_falls_to_the_noise(tour):
    (extended,) = results_of(tour, "extend")
    assert extended["over_floor"]["before"] > 2.0
    assert extended["over_floor"]["after"] < 1.1
    before, after = results_of(tour, "compare")
    for one, two in zip(before["runs"], after["runs"], strict=True):
        assert two["rate_rms_rad_s"] < 0.5 * one["rate_rms_rad_s"]


def test_the_tour_quotes_the_channel_that_fails_worse_and_the_other(tour):
    for step in (s for s in tour["steps"] if s["command"].split()[1] == "compare"):
        run = max(step["result"]["runs"], key=lambda r: r["over_noise"])
        worse, other = run["over_floor"]
        assert run["over_floor"][worse] >= run["over_floor"][other]
        said = [
            f"{name} fit is {number(run[f'{name}_fit_percent'], 3)} % ({over:.1f} x" for name, over in run["over_floor"].items()
        ]
        assert step["means"].index(said[0]) < step["means"].index(said[1])


def test_a_comparison_that_is_down_to_the_noise_sends_nobody_looking():
    compared = next(s for s in STEPS if s.line.startswith("compare"))
    over = {"judged_by": "angle", "over_noise": 1.02, "over_floor": {"angle": 1.02}}
    run = {"run": "a", **over, "angle_fit_percent": 96.0, "failing": [], "where": []}
    assert compared.tells({"runs": [run]})[1].endswith("That is the noise: here the model lacks nothing.")


def test_a_step_that_needs_what_nobody_learned_is_left_out():
    step = Step("", "extend {models}/a.yaml --add {effects}", lambda _result: ("", ""))
    assert not step.possible({"models": "m"})
    assert step.possible({"models": "m", "effects": "stall"})


def test_an_undecided_search_that_names_nothing_adds_nothing():
    (diagnose,) = (s for s in STEPS if s.line.startswith("diagnose"))
    assert diagnose.learns({"effects": []}) == {}
    assert diagnose.learns({"effects": ["stall", "delay"]}) == {"effects": "stall,delay"}
    assert "unexplained" in diagnose.tells({"effects": [], "verdict": "unexplained"})[1]


def test_the_textbook_model_leaves_more_than_the_noise_on_the_tour(run_cli, tmp_path):
    assert vehicle.misfit(vehicle.hidden_vehicle(demo.HIDDEN)) > vehicle.VISIBLE


def test_runs_that_judge_show_what_is_hidden():
    seen = vehicle.hidden_vehicle(demo.HIDDEN)
    assert vehicle.judging_maneuver(seen).name == "zigzag"
    # A zigzag of ten degrees hardly turns through the compass: what goes by heading does not show on it.
    by_heading = vehicle.hidden_vehicle("compass_deviation")
    assert vehicle.misfit(by_heading, pick_maneuver("zigzag")) < vehicle.SEEN
    assert vehicle.judging_maneuver(by_heading).name == "turning_circle"


def test_a_folder_with_files_is_not_touched(run_cli, tmp_path):
    (tmp_path / "mine.txt").write_text("keep")
    answer = run_cli("demo", "-o", tmp_path)
    assert answer.code == 2
    assert "is not empty" in answer.err
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


def test_a_second_tour_takes_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert demo._folder(None, force=False).name == "sysid-demo"
    (tmp_path / "sysid-demo").mkdir()
    assert demo._folder(None, force=False).name == "sysid-demo-2"


def test_a_mistyped_effect_is_refused_with_the_near_match(run_cli, tmp_path):
    answer = run_cli("demo", "--effect", "servolag", "-o", tmp_path / "new")
    assert answer.code == 2
    assert "did you mean `servo_lag`" in answer.err
    assert not (tmp_path / "new").exists()


def test_patterns_stand_for_the_files_they_match_in_order(tmp_path):
    for name in ("b.csv", "a.csv", "c.txt"):
        (tmp_path / name).touch()
    words = steps.expanded(["import", f"{tmp_path}/*.csv", "-o", "runs"])
    assert words == ["import", f"{tmp_path}/a.csv", f"{tmp_path}/b.csv", "-o", "runs"]
