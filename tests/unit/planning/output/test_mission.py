"""What is written for a vehicle, read back and flown: every limit ends the maneuver, and no file does nothing."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from moos_helm import Helm, corners, holds, inside, script
from plan_legs import ENVELOPE, leg, plan

from fieldsid.errors import UsageError
from fieldsid.maneuvers import Autopilot
from fieldsid.models.axis import Axis
from fieldsid.planning.belief.prior_model import named_prior
from fieldsid.planning.design.best_leg import ensemble_at, leg_of
from fieldsid.planning.design.objective import Setting, make_objective
from fieldsid.planning.flight.excitation import Excitation, Window
from fieldsid.planning.output.command_files import unwritten, write_all
from fieldsid.planning.output.mission import render, steps_of, styles
from fieldsid.planning.safety.envelope import Envelope
from fieldsid.planning.safety.monte_carlo import fly_ensemble

FULL = replace(ENVELOPE, pitch=0.4, track=20.0)
COURSE = np.radians(90.0)
ABOARD = {"NAV_SPEED": 1.4, "NAV_DEPTH": 3.0, "NAV_PITCH": 0.0, "NAV_ROLL": 0.0, "NAV_HEADING": 90.0, "NAV_X": 40.0, "NAV_Y": 0.0}
"""A vehicle on its leg to the east, started at the origin."""


def limited(one, **changes):
    return replace(plan(one), envelope=FULL, course=COURSE, **changes)


def helm_of(one, **changes):
    helm = Helm(render(limited(one, **changes), one, "moos_oparea.bhv"))
    helm.step(0.1, FIELDSID_FIN_OVERRIDE="true", **ABOARD)
    return helm


@pytest.mark.parametrize(
    "fault",
    [{"NAV_SPEED": 0.5}, {"NAV_DEPTH": 0.5}, {"NAV_DEPTH": 7.0}, {"NAV_PITCH": -0.5}, {"NAV_ROLL": 0.4}, {"NAV_HEADING": 160.0},
     {"NAV_HEADING": 10.0}, {"NAV_Y": 21.0}, {"NAV_Y": -21.0}, {"NAV_X": 201.0}, {"NAV_X": -1.0}],
    ids=str,
)  # fmt: skip
def test_a_helm_gives_the_fin_back_at_every_limit(fault):
    helm = helm_of(leg())
    helm.step(0.1)
    assert helm.variables["FIELDSID_ABORT"] == "false"
    helm.step(0.1, **fault)
    assert (helm.variables["FIELDSID_ABORT"], helm.variables["FIELDSID_FIN_OVERRIDE"]) == ("true", "false")


def test_a_helm_gives_the_fin_back_when_the_window_is_over_and_counts_each_pass_anew():
    helm = helm_of(leg())
    for _ in range(300):
        helm.step(0.1)
    assert helm.variables["FIELDSID_ABORT"] == "false"
    helm.step(0.1, FIELDSID_FIN_OVERRIDE="false")
    helm.step(0.1, FIELDSID_FIN_OVERRIDE="true", FIELDSID_CLOCK="reset")
    for _ in range(300):
        helm.step(0.1)
    assert helm.variables["FIELDSID_ABORT"] == "false"
    for _ in range(90):
        helm.step(0.1)
    assert helm.variables["FIELDSID_ABORT"] == "true"


def test_the_way_back_has_the_opposite_course():
    helm = helm_of(leg(passes=2))
    helm.step(0.1, FIELDSID_RETURN="true", NAV_HEADING=270.0)
    assert helm.variables["FIELDSID_ABORT"] == "false"
    helm.step(0.1, FIELDSID_RETURN="false")
    assert helm.variables["FIELDSID_ABORT"] == "true"


def test_a_script_does_not_start_before_everything_it_needs_is_there():
    for course, more in ((COURSE, {}), (None, {"FIELDSID_HEADING_WATCHED": "true"})):
        text = render(replace(limited(leg()), course=course), leg(), "moos_timer_script.moos")
        _, conditions = script(text)
        there = ABOARD | more | {"FIELDSID_START": "true", "FIELDSID_ABORT": "false"}
        assert all(holds(c, there) for c in conditions)
        for lacking in there:
            if lacking == "NAV_HEADING" and course is None:
                continue
            assert not all(holds(c, {n: v for n, v in there.items() if n != lacking}) for c in conditions), lacking


def test_a_script_posts_the_commands_and_gives_the_fin_back_at_its_end():
    events, _ = script(render(limited(leg()), leg(), "moos_timer_script.moos"))
    fins = [(t, float(v)) for t, n, v in events if n == "DESIRED_RUDDER"]
    wanted = [(s.time, s.degrees) for s in steps_of(plan(), leg()) if not s.autopilot]
    np.testing.assert_allclose(fins, wanted, atol=1e-3)
    assert [v for _, n, v in events if n == "FIELDSID_FIN_OVERRIDE"][-1] == "false"


@pytest.mark.parametrize("course", [None, 0.0, COURSE])
def test_the_polygon_is_the_area_that_was_tried(course):
    one = leg()
    points = corners(re.search(r"polygon = (.*)", render(replace(limited(one), course=course), one, "moos_oparea.bhv"))[1])
    for along, side, ok in ((1.0, 19.0, True), (199.0, -19.0, True), (1.0, 21.0, False), (-1.0, 0.0, False), (201.0, 0.0, False)):
        x, y = (along, side)
        if course is not None:
            x, y = (
                along * np.sin(course) + side * np.cos(course), along * np.cos(course) - side * np.sin(course),
            )  # fmt: skip
        assert inside(points, x, y) is ok


def test_an_ardupilot_script_tests_every_limit_in_code():
    code = re.sub(r"--.*", "", render(limited(leg()), leg(), "ardupilot.lua"))
    for word, limit in (("heading", "1.00000"), ("pitch", "0.40000"), ("roll", "0.30000"), ("depth", "6.00"), ("speed", "0.840"),
                        ("track", "20.00"), ("area", "186.00"), ("time", "38.00")):  # fmt: skip
        assert re.search(rf'> {limit}.*return "{word}"|< {limit}.*return "{word}"', code), word
    bare = re.sub(r"--.*", "", render(replace(plan(), envelope=Envelope(0.26)), leg(), "ardupilot.lua"))
    assert '"heading"' not in bare
    assert '"speed"' in bare


@pytest.mark.parametrize("style", styles())
def test_what_has_no_limit_is_named_in_every_file(style):
    text = render(replace(plan(), envelope=Envelope(0.26)), leg(), style)
    for name in ("heading", "track", "pitch", "roll", "depth", "area", "fin rate"):
        assert f"NOT LIMITED: {name}" in text


@pytest.mark.parametrize("style", [s for s in styles() if "oparea" not in s])
def test_a_rule_is_written_as_the_fins_it_is_expected_to_ask_for(style):
    text = render(plan(), leg("zigzag:duration=26"), style)
    assert "flown blind; 1.0% of the vehicles" in text
    assert "0.15" in text or "8.6" in text


def test_a_rule_whose_list_would_leave_the_envelope_is_not_written_and_said(tmp_path):
    far = leg("zigzag:duration=26", replay_risk=0.3)
    made = plan(leg(), far)
    names = [p.name for p in write_all(made, tmp_path)]
    assert names
    assert not any("zigzag" in n for n in names)
    (said,) = unwritten(made)
    assert said.startswith("no commands were written for leg 2: zigzag at 1.4 m/s follows the motion")
    assert "30%" in said
    with pytest.raises(UsageError, match="no list of fins") as caught:
        write_all(made, tmp_path / "csv", ["csv"])
    assert "--open-loop" in caught.value.hint
    assert not (tmp_path / "csv").exists()


def test_the_risk_of_a_list_is_that_of_flying_it_blind():
    model = named_prior("torpedo", Axis.YAW)
    setting = Setting(model, Envelope(0.26, 1.0, heading=np.radians(60.0)), Window(33.0), {})
    judge = make_objective(setting, 1.4)
    crowd = ensemble_at(judge)
    zigzag = Excitation("zigzag", leg("zigzag:amplitude=0.2,turn=0.5,duration=26").candidate.parameters)
    made = leg_of(judge, zigzag, crowd)
    blind = fly_ensemble(crowd, made.nominal, setting.envelope, judge.autopilot, judge.run_up).outside(setting.envelope)
    assert made.replay_risk == pytest.approx(float(np.mean(blind)))
    assert made.replay_risk > made.break_probability
    straight = fly_ensemble(crowd, np.zeros(0), setting.envelope, Autopilot(*_gains(judge)), judge.run_up)
    assert float(np.mean(straight.outside(setting.envelope))) == 0.0


def _gains(judge):
    pilot = judge.autopilot
    return pilot.angle_gain, pilot.rate_gain, pilot.fin


@given(st.text(max_size=30))
@pytest.mark.parametrize("style", styles())
def test_whatever_a_vehicle_is_called_a_mission_holds_the_same_lines(style, name):
    plain, named = (render(limited(leg(), vehicle=v), leg(), style) for v in ("torpedo", name))
    assert named.split("\n")[1:] == plain.split("\n")[1:]
    assert all(line.isprintable() for line in named.split("\n"))
