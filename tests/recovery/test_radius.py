"""Turning radius of the six-degree-of-freedom vehicle (equations apart from ours), identified from what a user records."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from truth.maneuvering.hulls import draw_hull
from truth.maneuvering.motion import true_turn
from truth.maneuvering.trials import training
from truth.pilots import Autopilot, excited, steady_turn, zigzagging
from truth.vehicle import Fins, Flight, Sea, fly_vehicle

from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model
from fieldsid.plant.parameter_source import load_parameter_source, source_of_models
from fieldsid.turning.measured.measured_turn import measure_turn
from fieldsid.turning.radius import turn_radius

FINS = Fins(lag=0.15)
SPEED = 1.54
SWAY = ("servo_lag", "sway_coupling", "quadratic_damping")
DRAG = ("servo_lag", "quadratic_damping", "speed_varying")
"""What this hull turns by: its cross-flow drag holds the rate long before the Munk moment shows."""
TIMES, PULSES = (0.0, 5.0, 7.0, 9.0, 20.0, 22.0, 24.0), (np.nan, 0.26, -0.26, np.nan, 0.15, -0.15, np.nan)


def run_of(name: str, flight: Flight) -> Run:
    log = dict(flight.log)
    return Run(name, log.pop("time_s"), log)


@pytest.fixture(scope="module")
def pulses() -> Run:
    return run_of("pulses", fly_vehicle(excited(Autopilot(), "yaw", TIMES, PULSES), 36.0, speed=SPEED, fins=FINS, seed=3))


@pytest.fixture(scope="module")
def zigzag() -> Run:
    return run_of(
        "zigzag", fly_vehicle(zigzagging(Autopilot(), "yaw", fin=0.2, angle=0.35, end=40.0), 45.0, speed=SPEED, fins=FINS, seed=4)
    )


def source_of(folder, runs, effects):
    (fit,) = identify(runs, Axis.YAW, effects=effects, joint=len(runs) > 1)
    return load_parameter_source([save_model(fit.model, folder / "model.yaml", force=True)])


@pytest.fixture(scope="module")
def dragged(tmp_path_factory, pulses, zigzag):
    """What pulses and zigzag, fitted with drag, predict at a rudder angle: an angle each is predicted once."""
    runs = [pulses, zigzag]
    source = source_of(tmp_path_factory.mktemp("drag"), runs, DRAG)
    return cache(lambda rudder: turn_radius(source, [SPEED], rudder, runs=runs))


@pytest.mark.parametrize("rudder", [pytest.param(0.2, marks=pytest.mark.slow), 0.3])
def test_pulses_and_zigzag_with_drag_predict_the_circle_within_five_percent_and_the_band_holds_it(dragged, rudder):
    truth = steady_turn(rudder, speed=SPEED, fins=FINS)["radius_m"]
    prediction = dragged(rudder)
    for row in prediction.rows:
        assert row.method == "maneuvering"
        assert row.radius == pytest.approx(truth, rel=0.05)
        assert row.interval95[0] <= truth <= row.interval95[1]
    assert prediction.surge.surge_measured


def test_the_band_of_pulses_alone_holds_the_truth(tmp_path, pulses):
    truth = steady_turn(0.3, speed=SPEED, fins=FINS)["radius_m"]
    for effects in ((), DRAG, SWAY):
        for row in turn_radius(source_of(tmp_path, [pulses], effects), [SPEED], 0.3, runs=[pulses]).rows:
            assert row.interval95[0] <= truth <= row.interval95[1], effects


def test_the_loss_of_speed_and_the_drift_are_those_of_the_turn(dragged):
    truth = steady_turn(0.3, speed=SPEED, fins=FINS)
    row = dragged(0.3).rows[0]
    assert row.turn_speed == pytest.approx(truth["speed_m_s"], rel=0.08)


@pytest.mark.parametrize("current", [(0.0, 0.0), (0.25, -0.15)], ids=["calm", "current"])
def test_a_measured_circle_is_the_true_one_within_half_a_percent(current):
    level = Autopilot(heading=None)

    def pilot(t, seen):
        return (0.25 if t > 8.0 else Autopilot()(t, seen)[0], level(t, seen)[1])

    flight = fly_vehicle(pilot, 150.0, speed=SPEED, fins=FINS, sea=Sea(current=current), seed=9)
    late = flight.truth["time_s"] > 90.0
    time, x, y, yaw = (flight.truth[n][late] for n in ("time_s", "x_m", "y_m", "yaw_rad"))
    through_water = np.hypot(np.gradient(x, time) - current[0], np.gradient(y, time) - current[1])
    truth = float(np.mean(through_water) / abs(np.mean(np.gradient(np.unwrap(yaw), time))))
    turn = measure_turn(run_of("circle", flight))
    assert turn.side == "port"
    assert turn.circle.radius == pytest.approx(truth, rel=0.005)
    assert turn.circle.current == pytest.approx(current, abs=0.01)


def test_a_sway_that_this_hull_hardly_shows_costs_accuracy_but_the_band_holds_the_truth(tmp_path, pulses, zigzag):
    truth = steady_turn(0.3, speed=SPEED, fins=FINS)["radius_m"]
    runs = [pulses, zigzag]
    for row in turn_radius(source_of(tmp_path, runs, SWAY), [SPEED], 0.3, runs=runs).rows:
        assert row.interval95[0] <= truth <= row.interval95[1]
        assert row.radius == pytest.approx(truth, rel=0.25)


@pytest.mark.slow
def test_an_unstable_hull_at_one_speed_of_which_no_fit_knows_which_way_the_fin_turns_has_its_circle_by_all_runs():
    whole = draw_hull(62, 47)
    hull = replace(whole, speeds=whole.speeds[:2])
    assert not hull.stable
    logs = training(hull, "pulses+zigzag", np.random.default_rng([47, 62, 1]), sway=True)
    runs = [Run(log.name, log.time, log.columns) for log in logs]
    models = [identify(runs[i : i + 2], Axis.YAW, effects=SWAY, joint=True)[0].model for i in (0, 2)]
    prediction = turn_radius(source_of_models(models, ["slow", "fast"]), hull.speeds, hull.rudder_limit, runs=runs)
    for row in prediction.rows:
        truth = true_turn(hull, row.speed, 1.0 if row.side == "starboard" else -1.0)[0]
        assert row.method == "maneuvering"
        assert row.radius == pytest.approx(truth, rel=0.15)
        assert row.interval95[0] <= truth <= row.interval95[1]
