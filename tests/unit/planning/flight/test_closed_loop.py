"""The closed loop against the free run of the same command, its plain version, and draws flown at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.dynamics.free_run import simulate
from fieldsid.maneuvers import Autopilot, Limits, parse_spec
from fieldsid.models.axis import Axis
from fieldsid.numerics.jit import plain_of
from fieldsid.numerics.trapezoid import trapezoid_integral
from fieldsid.planning.belief.prior_model import named_prior
from fieldsid.planning.discriminate.rivals import rivals_named
from fieldsid.planning.flight import rule_flight
from fieldsid.planning.flight.excitation import Excitation, Window, flown_all
from fieldsid.planning.flight.operating_point import autopilot_of, operating_point
from fieldsid.planning.safety.envelope import Envelope
from fieldsid.planning.safety.monte_carlo import draw_ensemble, fly_ensemble

WINDOW = Window(33.0)
LIMITS = Limits(0.3, 2.0)
PRIOR = named_prior("torpedo", Axis.YAW)


def candidate(spec):
    maneuver, values = parse_spec(spec)
    return Excitation(maneuver.name, values)


def scene_with(*effects):
    if not effects:
        return operating_point(PRIOR, 1.4)
    return operating_point(rivals_named(PRIOR, ("none", "+".join(effects)))[1], 1.4)


@pytest.mark.parametrize(
    "effects", [(), ("quadratic_damping",), ("sway_coupling",), ("servo_lag",), ("rate_limit", "stall"), ("delay",)]
)
def test_the_loops_motion_is_the_free_run_of_the_command_it_gave(effects):
    scene = scene_with(*effects)
    pilot = autopilot_of(scene.base, LIMITS)
    (response,) = flown_all([scene], candidate("square_pulses"), WINDOW, LIMITS, pilot)
    record = scene.record(response.time, response.command + scene.trim_fin)
    again = simulate(scene.model, record, state=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(response.angle, again.angle, atol=2e-4)
    np.testing.assert_allclose(response.rate, again.rate, atol=2e-4)


def test_the_compiled_loop_agrees_with_its_plain_version(monkeypatch):
    scene = scene_with("quadratic_damping")
    pilot = autopilot_of(scene.base, LIMITS)
    (fast,) = flown_all([scene], candidate("doublet"), Window(15.0), LIMITS, pilot)
    monkeypatch.setattr(rule_flight, "closed_loop", plain_of(rule_flight.closed_loop))
    (slow,) = flown_all([scene], candidate("doublet"), Window(15.0), LIMITS, pilot)
    np.testing.assert_allclose(fast.angle, slow.angle, atol=1e-12)
    np.testing.assert_allclose(fast.command, slow.command, atol=1e-12)


def test_the_autopilot_brings_the_vehicle_back():
    scene = scene_with()
    (response,) = flown_all([scene], candidate("square_pulses"), WINDOW, LIMITS, autopilot_of(scene.base, LIMITS))
    assert np.max(np.abs(response.angle)) > 0.1
    assert abs(response.angle[-1]) < 0.02


@pytest.mark.parametrize("axis", list(Axis))
def test_the_autopilot_is_stable_for_every_draw_of_the_prior(axis):
    model = named_prior("torpedo", axis)
    for speed in (0.8, 1.4, 2.2):
        crowd = draw_ensemble(model, speed, Window(40.0, recover=30.0), 60, 5)
        pilot = autopilot_of(operating_point(model, speed).base, LIMITS)
        flights = fly_ensemble(crowd, candidate("doublet:width=1,repeats=1"), Envelope(0.3), pilot, 0.0)
        assert np.max(np.abs(flights.angle[-20:])) < 0.25


@pytest.mark.parametrize("spec", ["square_pulses", "zigzag:duration=26"])
def test_draws_flown_at_once_are_those_flown_one_by_one(spec):
    model = replace(PRIOR, noise=replace(PRIOR.noise, disturbance=0.0))
    still = draw_ensemble(model, 1.4, WINDOW, 8, 3)
    pilot = autopilot_of(operating_point(model, 1.4).base, LIMITS)
    together = fly_ensemble(still, candidate(spec), Envelope(0.3, 2.0), pilot, 5.0)
    singly = flown_all(still.scenes, candidate(spec), WINDOW, LIMITS, pilot)
    for i, response in enumerate(singly):
        n = min(response.time.size, together.time.size)
        # The crowd's trim error is a constant moment of its own: it is small against the maneuver.
        assert np.max(np.abs(together.angle[:n, i] - response.angle[:n])) < 0.3
        assert together.excursions["heading"][i] == np.max(np.abs(together.angle[:, i]))
        # a sum over the samples of what the trapezoidal rule integrates
        along = trapezoid_integral(together.time, 1.4 * np.cos(together.angle[:, i]))
        assert together.excursions["along"][i] == pytest.approx(5.0 + np.max(along), rel=0.01)


@pytest.mark.parametrize("effects", [(), ("servo_lag",)])
def test_a_window_that_ends_before_the_rule_has_the_start_of_its_flight(effects):
    scene = scene_with(*effects)
    pilot = autopilot_of(scene.base, LIMITS)
    short, long = (flown_all([scene], candidate("zigzag:turn=1.5"), Window(s), LIMITS, pilot)[0] for s in (20.0, 67.0))
    assert short.time.size == 401 < long.time.size
    for part in ("time", "command", "angle", "rate"):
        np.testing.assert_array_equal(getattr(short, part), getattr(long, part)[:401])


def test_a_command_is_kept_inside_angle_and_rate_limits():
    scene = scene_with()
    limits = Limits(0.1, 0.4)
    (response,) = flown_all([scene], candidate("prbs:amplitude=0.5,duration=25"), WINDOW, limits, Autopilot(-5.0, -5.0))
    assert np.max(np.abs(response.command)) <= 0.1 + 1e-12
    assert np.max(np.abs(np.diff(response.command))) <= 0.4 / 20 + 1e-12
