"""A model that lacks an effect is seen to fail where that effect acts; the right one fails nowhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.comparison.compare import compare, left_in_words
from fieldsid.comparison.residuals import companions
from fieldsid.errors import DataError
from fieldsid.figures.compare import figure
from fieldsid.logs.run import Run
from fieldsid.maneuvers import Limits, parse_spec
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.planning.flight.dry_run import dry_run, with_noise

BASE = {"a22": 1.1, "b2": -1.2, "C0": 0.02}


def model(*effects, **values):
    return Model(Axis.YAW, effects, BASE | values, {}, (), np.zeros((0, 0)), SpeedLaw(1.4), Noise(0.005, 0.0035))


def run_of(truth, spec="zigzag", helpers=None):
    return with_noise(dry_run(truth, *parse_spec(spec), speed=1.4, limits=Limits(0.35), helpers=helpers), truth, 8)


def test_the_right_model_is_down_to_the_noise():
    truth = model("servo_lag", lag=0.3)
    (c,) = compare(truth, [run_of(truth)])
    assert c.merit.rate_rms == pytest.approx(0.0035, rel=0.1)
    assert c.merit.rate_rms / c.floor.rate == pytest.approx(1.0, rel=0.1)
    assert all(channel.metrics.whiteness_p > 1e-3 for channel in c.channels)
    assert c.worst_channel.metrics.r2 > 0.99
    assert c.failing == ()


def test_a_missing_lag_shows_at_the_onset():
    (c,) = compare(model(), [run_of(model("servo_lag", lag=0.3))])
    (rate,) = (channel for channel in c.failing if channel.name == "rate")
    (onset,) = [p for p in rate.where if p.condition == "phase: onset"]
    assert onset.rms_ratio > 1.5
    assert rate.metrics.whiteness_p < 1e-6


def test_a_compass_error_is_judged_by_the_angle():
    truth = model("compass_deviation", deviation_sin=0.2, deviation_cos=0.0)
    (c,) = compare(model(), [run_of(truth, "turning_circle")])
    assert c.worst_channel.name == "angle"


def test_the_channel_further_above_its_noise_leads_and_the_other_is_not_hidden():
    truth = model()
    (c,) = compare(replace(truth, values=truth.values | {"C0": 0.04}), [run_of(truth)])
    assert c.merit.angle_fit < 50.0 < c.merit.rate_fit  # a rate that is a little off adds up in the angle
    assert [channel.name for channel in c.failing] == ["angle", "rate"]
    assert c.worst_channel.over_floor == pytest.approx(c.merit.angle_rms / c.floor.angle)
    assert c.worst_channel.over_floor > c.channels[1].over_floor
    assert c.where == c.worst_channel.where


def test_in_a_log_without_noise_the_channel_of_less_fit_leads_and_no_multiple_of_its_digits_is_said():
    """A rate of all digits beside an angle of three: the floors say how a file was written, not which channel fails."""
    truth = model()
    run = dry_run(truth, *parse_spec("zigzag"), speed=1.4, limits=Limits(0.35))
    run = replace(run, signals={**run.signals, "yaw_rad": np.round(run.signals["yaw_rad"], 3)})
    (c,) = compare(replace(truth, values=truth.values | {"C0": 0.04}), [run])
    angle, rate = sorted(c.channels, key=lambda channel: channel.name)
    assert rate.over_floor > angle.over_floor > 100.0
    assert c.merit.angle_fit < c.merit.rate_fit
    assert c.worst_channel is angle
    assert left_in_words(angle.over_floor, angle.fit) == f"fit {c.merit.angle_fit:.1f} %"
    assert left_in_words(4.26, 50.0) == "4.3 x its noise"


def test_the_figure_shows_the_channels_that_fail_in_their_order_and_shades_nothing_at_the_noise():
    truth = model()
    run = run_of(truth)
    bad, good = (compare(replace(truth, values=truth.values | {"C0": c0}), [run])[0] for c0 in (0.04, 0.02))
    motion, places = figure(bad, "bad").columns
    assert [b.title.partition(" at ")[0] for b in places] == ["the angle fails most", "the rate fails most"]
    assert {p.spans for p in motion} == {tuple((s.start_s, s.end_s) for s in bad.worst_channel.worst)}
    (motion,) = figure(good, "good").columns
    assert {p.spans for p in motion} == {()}


def test_the_missing_moment_moves_with_the_signal_that_makes_it():
    truth = model("roll_coupling", roll_moment=0.4)
    run = run_of(truth, helpers=lambda t: {"roll": 0.15 * np.sin(t)})
    (c,) = compare(model(), [run])
    assert c.moves_with[0].signal == "roll"
    assert c.moves_with[0].explained > 0.5


def test_a_run_without_a_rate_has_no_missing_moment():
    run = run_of(model())
    bare = Run("bare", run.time, {k: v for k, v in run.signals.items() if k != "yaw_rate_rad_s"})
    (c,) = compare(model(), [bare])
    assert [channel.name for channel in c.channels] == ["angle"]
    assert companions(c.shown, 1.0) == ()
    assert np.isnan(c.merit.rate_rms)


def test_a_run_without_a_fin_is_refused():
    run = run_of(model())
    with pytest.raises(DataError, match="no fin signal") as error:
        compare(model(), [Run("bare", run.time, {"yaw_rad": run["yaw_rad"]})])
    assert "--axis" not in error.value.hint
    with pytest.raises(DataError, match="no fin signal") as error:
        compare(model(), [Run("bare", run.time, {"yaw_rad": run["yaw_rad"], "elevator_measured_rad": run["yaw_rad"]})])
    assert "`--axis pitch`" in error.value.hint
