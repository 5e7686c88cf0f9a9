"""The area as it is exported: from the start of the run-up on, half of its width to either side; every limit has its abort."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plan_legs import leg

from fieldsid.models.axis import Axis
from fieldsid.planning.belief.prior_model import named_prior
from fieldsid.planning.design.leg import aborts_of
from fieldsid.planning.design.plan import Request, setting_at
from fieldsid.planning.safety.envelope import NOT_LIMITED, Envelope, excursions_of, limits_said, outside, used

TIME = 0.05 * np.arange(801)


def flown(heading, run_up):
    """How far a flight goes that holds a heading in rad at 1 m/s."""
    angle = np.full((TIME.size, 1), heading)
    return excursions_of(Axis.YAW, angle, 0.0 * angle, speed=1.0, step=0.05, run_up=run_up, roll_gain=1.0)


def test_a_flight_all_to_one_side_leaves_an_area_whose_half_it_leaves():
    sideways = flown(np.pi / 2, 10.0)  # 40 m to starboard
    assert sideways["across"] == pytest.approx(40.0, abs=0.1)
    assert used(sideways, Envelope(0.2, area_length=100.0, area_width=60.0)) > 1.3
    assert used(sideways, Envelope(0.2, area_length=100.0, area_width=90.0)) < 1.0


def test_the_area_begins_at_the_start_of_the_run_up():
    area = Envelope(0.2, area_length=100.0, area_width=60.0)
    assert used(flown(np.pi, 50.0), area) < 1.0
    behind = flown(np.pi, 30.0)
    assert behind["behind"] == pytest.approx(10.0, abs=0.1)
    assert used(behind, area) > 1.0


@pytest.mark.parametrize("speed", [0.7, 1.2, 1.4, 2.0])
@pytest.mark.parametrize("length", [40.0, 50.0, 61.3])
def test_a_straight_flight_of_the_window_that_an_area_leaves_stays_inside(speed, length):
    area = Envelope(0.2, area_length=length, area_width=60.0)
    window = setting_at(named_prior("torpedo", Axis.YAW), Request(Axis.YAW, (speed,), area, {}), speed).window
    straight = np.zeros((window.time.size, 1))
    flight = excursions_of(Axis.YAW, straight, straight, speed=speed, step=0.05, run_up=10.0 * speed, roll_gain=1.0)
    assert flight["along"] == pytest.approx(speed * (10.0 + window.length), rel=1e-9)
    assert not outside(flight, area)
    assert outside(flight, Envelope(0.2, area_length=length - 0.1, area_width=60.0)) == (window.length < 33.0)


def test_every_limit_that_is_set_ends_the_maneuver_whatever_axis_it_moves():
    limits = Envelope(
        0.26, 1.0, heading=1.0, track=20.0, depth_low=1.0, depth_high=6.0, pitch=0.4, roll=0.3, area_length=200.0, area_width=50.0
    )
    found = {(a.signal, a.kind): a.limit for a in aborts_of(leg(), limits)}
    assert found == {
        ("time_s", "time"): 38.0, ("surge_m_s", "below"): pytest.approx(0.84), ("yaw_rad", "deviation"): 1.0,
        ("pitch_rad", "deviation"): 0.4, ("roll_rad", "deviation"): 0.3, ("depth_m", "above"): 6.0, ("depth_m", "below"): 1.0,
        ("y_m", "deviation"): 20.0, ("x_m", "above"): pytest.approx(186.0), ("x_m", "below"): pytest.approx(-14.0),
    }  # fmt: skip
    bare = {a.signal for a in aborts_of(leg(), Envelope(0.26))}
    assert bare == {"time_s", "surge_m_s"}


def test_a_leg_with_a_heading_of_its_own_is_ended_by_that():
    circle = replace(leg(), heading=9.0)
    (heading,) = (a for a in aborts_of(circle, Envelope(0.26, heading=1.0)) if a.signal == "yaw_rad")
    assert heading.limit == 9.0


def test_limits_are_said_in_both_units_and_their_lack_is():
    said = limits_said(Envelope(0.26, heading=np.radians(60.0), area_length=200.0, area_width=50.0))
    assert said["heading"] == "60 deg (1.05 rad)"
    assert said["area"] == "200 m along, 25 m to either side"
    assert {n for n, words in said.items() if words == NOT_LIMITED} == {"fin rate", "track", "pitch", "roll", "depth"}


def test_what_to_widen_is_named_by_its_option():
    room = Envelope(0.2, heading=1.0, area_length=100.0, area_width=60.0)
    assert room.widening() == "widen `--max-heading` or `--area`"
    assert Envelope(0.2, heading=None, pitch=None).widening() == "allow more fin: `--fin-max`"
