"""Quantities, wishes, envelopes and priors as users give them: what is read, and what is refused with what would be possible."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from in_time import in_time

from fieldsid.angles import parse_angle
from fieldsid.errors import ArtifactError, FieldsidError, ModelError, UsageError
from fieldsid.maneuvers import all_maneuvers, pick_maneuver
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model
from fieldsid.planning.belief.prior_model import (
    UNMEASURED,
    checked_prior,
    corner,
    draws_of,
    load_believed,
    named_prior,
    scales_of,
)
from fieldsid.planning.design.objective import Setting, make_objective
from fieldsid.planning.design.optimise import LEFT_OUT, SHORTEST_HOLD_S, _start_of, merge_short_holds
from fieldsid.planning.flight.excitation import Excitation, Window, fits
from fieldsid.planning.flight.operating_point import operating_point
from fieldsid.planning.request import EnvelopeLimits, envelope_of
from fieldsid.planning.safety.envelope import Envelope, check_room, check_speeds
from fieldsid.planning.specify.quantities import accuracy_goals_text, parse_accuracy_goals, parse_area, parse_band, parse_speeds
from fieldsid.templates import template_path
from fieldsid.vehicle import Vehicle

KNOWN = ("a22", "b2", "C0")


def test_areas_bands_and_speeds_are_read():
    assert parse_area("200x60") == (200.0, 60.0)
    assert parse_band("1:5.5") == (1.0, 5.5)
    assert parse_speeds("1.0,1.4,1.4,1.8") == (1.0, 1.4, 1.8)
    assert parse_speeds("1.0:1.8:0.4") == (1.0, 1.4, 1.8)


@given(st.lists(st.floats(0.0, 6.0), min_size=16, max_size=16), st.sampled_from([5.0, 20.0, 30.0]))
def test_holds_in_whole_samples_take_no_longer_than_those_they_come_from(holds, rate_hz):
    tidy = merge_short_holds(np.array(holds), 1.0 / rate_hz)
    assert tidy.size == len(holds)
    assert tidy.sum() <= sum(holds) + 1e-6
    assert np.allclose(tidy * rate_hz, np.round(tidy * rate_hz), atol=1e-6)
    assert (tidy[tidy > 0][:-1] >= SHORTEST_HOLD_S - 1e-6).all() or np.count_nonzero(tidy) == 1


@given(st.text(max_size=12))
def test_no_text_makes_the_readers_fail_with_anything_but_a_usage_error(text):
    for read in (
        lambda t: parse_angle(t, "--x", 1.0),
        parse_area,
        parse_band,
        parse_speeds,
        lambda t: parse_accuracy_goals(t, KNOWN),
    ):
        refusal = refused(read, text)
        assert refusal is None or (refusal.hint and refusal.found)


def refused(read, text):
    """The usage error a reader raises, None where it reads."""
    try:
        read(text)
    except UsageError as error:
        return error
    return None


def test_speeds_beyond_the_most_are_refused_and_none_left_out():
    assert len(parse_speeds(",".join(map(str, range(1, 51))) + ",1,2")) == 50
    assert "51 speeds" in refused(parse_speeds, ",".join(map(str, range(1, 52)))).what


def test_a_wish_is_read_in_per_cent_or_as_a_share_and_written_back():
    wish = parse_accuracy_goals("a22=5%, b2=0.03", KNOWN)
    assert wish == {"a22": pytest.approx(0.05), "b2": pytest.approx(0.03)}
    assert accuracy_goals_text(wish) == "a22=5%,b2=3%"
    assert parse_accuracy_goals(accuracy_goals_text({"a22": 0.07123}), KNOWN)["a22"] >= 0.07123


@pytest.mark.parametrize(
    ("text", "hint"), [("a2=5%", "`a22`"), ("a22", "a22=5%"), ("a22=0%", "%"), ("a22=500%", "%"), ("a22=x", "a22=5%"),
     ("", "a22=5%"), (" , ", "a22=5%"), ("a22=5%,b2=3%,a22=3%", "`--want a22=3%`")],
)  # fmt: skip
def test_a_wish_that_cannot_be_meant_is_refused(text, hint):
    with pytest.raises(UsageError) as caught:
        parse_accuracy_goals(text, KNOWN)
    assert hint in caught.value.hint


@pytest.mark.parametrize(
    "limits",
    [
        {"fin": 0.0}, {"fin": 26.0}, {"fin": 0.2, "fin_rate": 0.0}, {"fin": 0.2, "heading": -1.0}, {"fin": 0.2, "pitch": 30.0},
        {"fin": 0.2, "roll": 20.0}, {"fin": 0.2, "area_length": 0.0}, {"fin": 0.2, "depth_low": 5.0, "depth_high": 1.0},
        {"fin": 0.2, "share": 0.0}, {"fin": 0.2, "share": 5.0}, {"fin": float("nan")},
    ],
)  # fmt: skip
def test_limits_of_nothing_or_in_wrong_units_are_refused_in_three_parts(limits):
    with pytest.raises(UsageError) as caught:
        Envelope(**limits)
    assert caught.value.found
    assert caught.value.hint


def test_degrees_taken_for_radians_are_answered_with_how_to_write_them():
    with pytest.raises(UsageError) as caught:
        Envelope(0.2, pitch=30.0)
    assert "`30deg`" in caught.value.hint


def test_an_area_shorter_than_the_run_up_is_refused_with_what_would_fit():
    with pytest.raises(UsageError) as caught:
        check_room(Envelope(0.2, area_length=20.0, area_width=30.0), (1.0, 2.0), 10.0, 15.0)
    assert "--area 50x30" in caught.value.hint or "0.8 m/s" in caught.value.hint
    check_room(Envelope(0.2, area_length=51.0), (2.0,), 10.0, 15.0)


def test_the_speed_that_an_area_is_said_to_allow_is_not_refused():
    with pytest.raises(UsageError) as caught:
        check_room(Envelope(0.2, area_length=49.0, area_width=20.0), (2.0,), 10.0, 15.0)
    assert caught.value.hint.startswith("fly at most 1.96 m/s there")
    check_room(Envelope(0.2, area_length=49.0, area_width=20.0), (1.96,), 10.0, 15.0)


@pytest.mark.parametrize(("typed", "what"), [({"fin": "21deg"}, "--fin-max"), ({"fin_rate": "30deg"}, "--fin-rate")])
def test_no_limit_of_the_vehicles_own_is_exceeded(typed, what):
    vehicle = Vehicle("one", rudder_max_rad=np.radians(20.0), fin_rate_rad_s=0.5)
    with pytest.raises(UsageError, match=f"`{what}` .* is more than the vehicle has"):
        envelope_of(Axis.YAW, EnvelopeLimits(**typed), vehicle)


def test_a_vehicles_limit_may_be_typed_with_a_few_digits_and_is_kept():
    vehicle = Vehicle("one", rudder_max_rad=np.radians(20.0), fin_rate_rad_s=0.5)
    assert envelope_of(Axis.YAW, EnvelopeLimits(fin="0.349066rad", fin_rate="28.648deg"), vehicle) == (
        envelope_of(Axis.YAW, EnvelopeLimits(), vehicle)
    )


@pytest.mark.parametrize(
    ("speeds", "low", "high"),
    [((), None, None), ((0.0,), None, None), ((-1.0,), None, None), ((60.0,), None, None), ((3.0,), 0.5, 2.0)],
)
def test_speeds_that_cannot_be_right_are_refused(speeds, low, high):
    with pytest.raises(UsageError) as caught:
        check_speeds(speeds, low, high)
    assert caught.value.hint


def test_a_window_without_room_for_the_excitation_is_refused():
    with pytest.raises(UsageError, match="leaves"):
        Window(8.0)


@pytest.mark.parametrize("length", [9.0, 10.0, 12.0])
def test_a_maneuver_is_made_to_fit_a_short_window_or_left_out(length):
    """Pulses without a rest between them are still too long there: the rest cannot be shortened for ever."""
    judge = make_objective(Setting(named_prior("torpedo", Axis.YAW), Envelope(0.26), Window(length), {}), 1.4)
    with in_time(20):
        started = [_start_of(m, judge) for m in all_maneuvers().values() if m.name not in LEFT_OUT]
    assert any(s is not None for s in started)
    assert all(fits(s, judge.window) for s in started if s is not None)


def test_an_unstable_prior_is_refused_and_one_held_by_quadratic_damping_is_not(tmp_path):
    text = template_path("plan/priors/torpedo_yaw.yaml").read_text().replace("value: 1.1", "value: -0.3")
    (tmp_path / "wild.yaml").write_text(text)
    with pytest.raises(ModelError, match="doubles every") as caught:
        checked_prior(load_believed(tmp_path / "wild.yaml"), Axis.YAW, (1.4,))
    assert "quadratic_damping" in caught.value.hint
    held = text.replace("effects: []", "effects: [quadratic_damping]").replace(
        "parameters:\n", "parameters:\n  quadratic: {value: 3.0, std_error: 0.5, unit: 1/rad}\n"
    )
    (tmp_path / "held.yaml").write_text(held)
    assert checked_prior(load_believed(tmp_path / "held.yaml"), Axis.YAW, (1.4,)).effects == ("quadratic_damping",)


@pytest.mark.parametrize(
    ("a22", "cross_rate", "unstable"), [(-3.2, 20.0, False), (-3.2, 10.0, True), (1.1, 0.2, False), (1.1, -8.0, True)]
)
def test_a_prior_is_as_stable_as_it_is_with_its_sway(a22, cross_rate, unstable):
    """By the textbook's two conditions of a cubic without its free heading: a + c > 0 and a c + c_r > 0."""
    plain = named_prior("torpedo", Axis.YAW)
    values = {**plain.values, "a22": a22, "cross_damping": 5.67, "cross_rate": cross_rate}
    model = replace(plain, effects=("sway_coupling",), values=values, free=())
    assert (a22 + 5.67 > 0.0 and 5.67 * a22 + cross_rate > 0.0) is not unstable
    if not unstable:
        assert checked_prior(model, Axis.YAW, (model.law.reference,)) is model
        return
    with pytest.raises(ModelError, match="unstable"):
        checked_prior(model, Axis.YAW, (model.law.reference,))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("  b2:", "  b3:"), ("value: 1.1", "value: fast"), ("axis: yaw", "axis: roll"), ("angle: 0.00524", "angle: 0"),
        ("rate: 0.00524", "rat: 0.00524"), ("effects: []", "effects: [drag]"), ("parameters:", "paramters:"),
    ],
)  # fmt: skip
def test_a_prior_with_a_mistake_is_refused(tmp_path, old, new):
    text = template_path("plan/priors/torpedo_yaw.yaml").read_text()
    assert old in text
    (tmp_path / "prior.yaml").write_text(text.replace(old, new, 1))
    with pytest.raises(FieldsidError) as caught:
        load_believed(tmp_path / "prior.yaml")
    assert caught.value.hint


def test_a_channel_that_a_models_runs_did_not_measure_tells_nothing(tmp_path):
    prior = named_prior("torpedo", Axis.YAW)
    silent = replace(
        prior, noise=replace(prior.noise, rate=1e-7), info={"left": {"noise_floor": {"angle_rad": 0.005, "rate_rad_s": None}}}
    )
    believed = load_believed(save_model(silent, tmp_path / "yaw.yaml"))
    assert (believed.noise.angle, believed.noise.rate) == (prior.noise.angle, UNMEASURED)
    pulses = Excitation("square_pulses", pick_maneuver("square_pulses").defaults)
    errors = [
        make_objective(Setting(m, Envelope(0.26), Window(), {}), 1.4).expected(pulses).std_errors()["a22"]
        for m in (believed, silent)
    ]
    assert errors[0] > 1.3 * errors[1]


@pytest.mark.parametrize("speed", [0.4, 0.6, 1.4, 2.5])
def test_an_error_is_a_share_of_what_is_believed_at_the_speed_of_the_leg(speed):
    prior = named_prior("torpedo", Axis.YAW)
    base = operating_point(prior, speed).base
    scales = scales_of(prior, base, 0.26)
    assert (scales["a22"], scales["b2"]) == pytest.approx((base.damping, -base.authority))
    vague = replace(prior, covariance=np.diag([4.0 * 1.1**2, 0.3**2, 0.01**2]))
    assert scales_of(vague, base, 0.26)["a22"] == pytest.approx(2.0 * base.damping)


def test_an_unknown_prior_is_answered_with_the_near_one():
    with pytest.raises(UsageError) as caught:
        named_prior("torpdo", Axis.YAW)
    assert "torpedo" in caught.value.hint
    with pytest.raises(UsageError):
        checked_prior(named_prior("torpedo", Axis.YAW), Axis.PITCH, (1.0,))


@pytest.mark.parametrize("axis", list(Axis))
def test_draws_keep_the_signs_of_damping_and_authority_and_spread_as_stated(axis):
    model = named_prior("torpedo", axis)
    drawn = draws_of(model, 800, 1)
    for name in model.base:
        values = np.array([d.values[name] for d in drawn])
        if name in ("a22", "c22", "b2", "d2"):
            assert np.all(np.sign(values) == np.sign(model.values[name]))
        if name != "c23":  # cut at zero: a stiffness is not drawn negative
            assert np.std(values) == pytest.approx(model.std_error(name), rel=0.25)


def test_a_corner_with_a_stronger_fin_is_stronger_whatever_its_sign():
    model = named_prior("torpedo", Axis.YAW)
    assert abs(corner(model, {"b2": -1.0}).values["b2"]) > abs(model.values["b2"])


def test_a_file_that_is_no_prior_is_refused(tmp_path):
    (tmp_path / "x.yaml").write_text("schema: fieldsid/vehicle/1\nname: a\n")
    with pytest.raises(ArtifactError):
        load_believed(tmp_path / "x.yaml")
