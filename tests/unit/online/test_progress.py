"""How far a live estimate is: share of the information, settled or not, and what is said."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isnan, nan

import pytest
from online_flights import fed, flown

from fieldsid.errors import UsageError
from fieldsid.models.axis import Axis
from fieldsid.online import OnlineEstimate, OnlineIdentifier
from fieldsid.online.goals import requested_goals
from fieldsid.online.look import look_body, verdict_sentence
from fieldsid.online.progress import Goal, RecentExcitation, Watch, default_goals


def estimate(time, value, error, trim=0.0):
    values = {"a22": 1.0, "b2": value, "C0": trim}
    return OnlineEstimate(Axis.YAW, time, values, {"a22": 0.01, "b2": error, "C0": 0.1}, 100, 1.4, {})


def test_the_share_is_that_of_the_information_and_of_the_parameter_that_limits():
    watch = Watch(default_goals(Axis.YAW))
    found = watch.look(estimate(0.0, -1.0, 0.1))
    assert found.share == pytest.approx(0.25)
    assert found.limited_by == "b2"
    assert isnan(found.left_s)


def test_the_time_that_is_left_follows_from_how_fast_the_information_grows():
    watch = Watch(default_goals(Axis.YAW))
    for time in range(1, 21):
        found = watch.look(estimate(float(time), -1.0, 0.5 / time**0.5))
    # 0.05 is reached at 100 s
    assert found.left_s == pytest.approx(80.0, rel=0.01)
    assert watch.look(estimate(21.0, -1.0, 1.0)).left_s == inf


def test_enough_needs_the_goal_and_ten_seconds_of_rest():
    watch = Watch(default_goals(Axis.YAW))
    verdicts = [watch.look(estimate(t, -1.0 if t > 5.0 else -3.0, 0.02)).verdict for t in [0.5 * i for i in range(40)]]
    assert verdicts[0] == "moving"
    assert verdicts.index("enough") == pytest.approx(31, abs=2)


def test_a_trim_has_no_goal_unless_it_is_asked_for():
    watch = Watch(default_goals(Axis.YAW))
    looks = [watch.look(estimate(t, -1.0, 0.02, trim=t)).verdict for t in [float(i) for i in range(15)]]
    assert looks[-1] == "enough"
    assert requested_goals(Axis.YAW, "C0=10%")["C0"] == Goal(relative=0.1)
    with pytest.raises(UsageError, match="no parameter"):
        requested_goals(Axis.YAW, "c22=5%")


def test_a_fin_that_is_still_is_said():
    watch = Watch(default_goals(Axis.YAW))
    for i in range(200):
        watch.excitation.hear(0.1 * i, 0.1, 0.0)
    found = watch.look(estimate(20.0, -1.0, 0.2))
    assert found.verdict == "not_excited"
    assert "fin is still (0.0 deg rms)" in verdict_sentence(found)


def test_the_excitation_of_the_last_seconds_is_a_root_mean_square():
    recent = RecentExcitation()
    assert isnan(recent.rms()[0])
    for i in range(600):
        recent.hear(0.1 * i, 0.2 if i // 20 % 2 else -0.2, nan if i % 3 == 0 else 0.05)
    fin, rate = recent.rms()
    assert fin == pytest.approx(0.2, rel=0.05)
    assert rate == pytest.approx(0.0, abs=1e-6)


def test_a_flight_goes_from_starting_to_enough():
    online, watch = OnlineIdentifier("yaw"), Watch(default_goals(Axis.YAW))
    verdicts = []
    for i, sample in enumerate(zip(*(s.tolist() for s in flown(count=2400)), strict=True)):
        online.update(*sample)
        watch.excitation.hear(sample[0], sample[1], sample[3])
        if i % 20 == 0:
            verdicts.append(watch.look(online.estimate()).verdict)
    assert verdicts[0] == "starting"
    assert verdicts[-1] == "enough"
    assert "collecting" in verdicts or "moving" in verdicts


def test_a_look_is_plain_and_its_sentence_leads_with_the_number():
    now = fed(OnlineIdentifier("yaw"), flown(count=400)).estimate()
    body = look_body(now, Watch(default_goals(Axis.YAW)).look(now), source="x", goals_from="y", unreadable=2, then="")
    assert body["counts"]["unreadable"] == 2
    assert body["said"].split()[0].isdecimal() or body["said"].startswith("enough")
    assert body["parameters"]["a22"]["interval95"][0] < body["parameters"]["a22"]["value"]


def test_nothing_is_enough_where_angle_and_rate_contradict_each_other():
    watch = Watch(default_goals(Axis.YAW))
    for time in range(30):
        found = watch.look(replace(estimate(float(time), -1.0, 0.02), contradiction="the slope is -1, should be 1"))
    assert (found.verdict, found.share) == ("contradicts", 0.0)
    assert verdict_sentence(found) == "0 % of the data can be used: the slope is -1, should be 1"
    assert watch.look(estimate(30.0, -1.0, 0.02)).verdict == "enough"
