"""A rehearsal is the model's own motion: replaying the fin it flew gives the same motion back."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.dynamics.free_run import simulate
from fieldsid.maneuvers import Limits, parse_spec
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import record_of
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.planning.flight.dry_run import dry_run, with_noise

LIMITS = Limits(0.35)


def model(*effects, **values):
    base = {"a22": 1.1, "b2": -1.2, "C0": 0.02}
    return Model(Axis.YAW, effects, base | values, {}, (), np.zeros((0, 0)), SpeedLaw(1.4), Noise(0.005, 0.004))


@pytest.mark.parametrize("spec", ["square_pulses", "zigzag:amplitude=10deg"])
@pytest.mark.parametrize(("effects", "values"), [((), {}), (("servo_lag", "delay"), {"lag": 0.3, "delay": 0.12})])
def test_replaying_the_fin_of_a_rehearsal_gives_its_motion_back(spec, effects, values):
    vehicle = model(*effects, **values)
    run = dry_run(vehicle, *parse_spec(spec), speed=1.4, limits=LIMITS)
    again = simulate(vehicle, record_of(run, Axis.YAW), state=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(again.angle, run["yaw_rad"], atol=1e-9)
    np.testing.assert_allclose(again.rate, run["yaw_rate_rad_s"], atol=1e-9)


def test_the_vehicle_starts_at_rest_about_its_trim():
    run = dry_run(model(), *parse_spec("square_pulses"), speed=1.4, limits=LIMITS)
    assert run["rudder_rad"][0] == pytest.approx(0.02 / 1.2)
    np.testing.assert_allclose(run["yaw_rate_rad_s"][:30], 0.0, atol=1e-12)


def test_a_zigzag_turns_its_rudder_at_the_heading_the_lagging_vehicle_shows():
    run = dry_run(model("servo_lag", lag=0.5), *parse_spec("zigzag:amplitude=10deg,turn=15deg"), speed=1.4, limits=LIMITS)
    fin, yaw = run["rudder_rad"] - run["rudder_rad"][0], np.degrees(run["yaw_rad"])
    turned = np.flatnonzero(np.abs(np.diff(np.sign(fin))) == 2)[:3]
    assert turned.size == 3
    np.testing.assert_allclose(np.abs(yaw[turned]), 15.0, atol=1.0)


def test_the_log_of_an_early_clock_shows_the_motion_before_its_cause():
    run = dry_run(model("clock_offset", offset=-0.4), *parse_spec("square_pulses"), speed=1.4, limits=LIMITS)
    late = dry_run(model(), *parse_spec("square_pulses"), speed=1.4, limits=LIMITS)
    np.testing.assert_allclose(run["yaw_rate_rad_s"][:100], late["yaw_rate_rad_s"][8:108], atol=1e-9)
    assert np.abs(late["yaw_rate_rad_s"][8:108]).max() > 0.1


def test_helper_signals_reach_the_model_and_the_run():
    vehicle = model("roll_coupling", roll_moment=0.5)
    run = dry_run(vehicle, *parse_spec("square_pulses"), speed=1.4, limits=LIMITS, helpers=lambda t: {"roll": 0.1 * np.sin(t)})
    np.testing.assert_allclose(run["roll_rad"], 0.1 * np.sin(run.time))
    assert np.abs(run["yaw_rate_rad_s"][:30]).max() > 1e-3


def test_noise_has_the_models_own_spread_and_comes_from_the_seed():
    vehicle = model()
    run = dry_run(vehicle, *parse_spec("square_pulses"), speed=1.4, limits=LIMITS)
    one, same, other = (with_noise(run, vehicle, s) for s in (1, 1, 2))
    assert np.std(one["yaw_rad"] - run["yaw_rad"]) == pytest.approx(0.005, rel=0.15)
    np.testing.assert_array_equal(one["yaw_rad"], same["yaw_rad"])
    assert not np.array_equal(one["yaw_rad"], other["yaw_rad"])
