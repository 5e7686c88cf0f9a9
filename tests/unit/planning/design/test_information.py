"""Fisher information against differences of the free run, a hand-worked case, and the addition of runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.dynamics.free_run import simulate
from fieldsid.maneuvers import Limits, parse_spec
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.planning.belief.prior_model import named_prior
from fieldsid.planning.design.objective import Information, information_of
from fieldsid.planning.flight.excitation import Excitation, Window, flown
from fieldsid.planning.flight.operating_point import autopilot_of, operating_point

LIMITS = Limits(0.3)


def flight(scene, spec="three_two_one_one", window=None):
    maneuver, values = parse_spec(spec)
    window = window or Window(30.0)
    return flown(scene, Excitation(maneuver.name, values), window, LIMITS, autopilot_of(scene.base, LIMITS))


@pytest.mark.parametrize(("axis", "speed"), [(Axis.YAW, 1.4), (Axis.YAW, 2.0), (Axis.PITCH, 1.0)])
def test_white_noise_information_is_that_of_differences_of_the_free_run(axis, speed):
    model = named_prior("torpedo", axis)
    model = replace(model, noise=Noise(0.005, 0.008))
    scene = operating_point(model, speed)
    response = flight(scene)
    record = scene.record(response.time, response.command + scene.trim_fin)
    names = [*model.base]
    columns = []
    for name in names:
        step = 1e-5
        ends = [
            simulate(replace(model, values={**model.values, name: model.values[name] + s}), record, state=(0, 0, 0))
            for s in (step, -step)
        ]
        columns.append(
            np.concatenate([(ends[0].angle - ends[1].angle) / 0.005, (ends[0].rate - ends[1].rate) / 0.008]) / (2 * step)
        )
    for state in ((1e-5, 0, 0), (0, 1e-5, 0)):
        ends = [simulate(model, record, state=tuple(s * v for v in state)) for s in (1, -1)]
        columns.append(np.concatenate([(ends[0].angle - ends[1].angle) / 0.005, (ends[0].rate - ends[1].rate) / 0.008]) / 2e-5)
    covariance = np.linalg.inv(np.array(columns) @ np.array(columns).T)
    found = information_of(scene, response).std_errors()
    at_speed = model.at_speed(speed)
    for i, name in enumerate(names):
        growth = at_speed[name] / model.values[name] if model.values[name] else model.law.trim_factor(speed)
        assert found[name] == pytest.approx(np.sqrt(covariance[i, i]) * abs(growth), rel=1e-3), name


def test_a_disturbance_makes_every_parameter_worse():
    model = named_prior("torpedo", Axis.YAW)
    errors = []
    for disturbance in (0.0, 0.005, 0.02):
        scene = operating_point(replace(model, noise=Noise(0.005, 0.005, disturbance)), 1.4)
        errors.append(information_of(scene, flight(scene)).std_errors())
    for name in errors[0]:
        assert errors[0][name] < errors[1][name] < errors[2][name]


def test_what_a_flight_cannot_tell_apart_has_no_finite_error():
    twin = Information(("a", "b", "c"), np.array([[4.0, 4.0, 0.0], [4.0, 4.0, 0.0], [0.0, 0.0, 25.0]]))
    assert twin.std_errors() == {"a": np.inf, "b": np.inf, "c": pytest.approx(0.2)}
    unseen = Information(("a", "b"), np.diag([4.0, 0.0]))
    assert unseen.std_errors()["b"] == np.inf


def test_correlated_parameters_are_worked_by_hand():
    # inverse of [[4, 2], [2, 4]] has 1/3 on its diagonal
    pair = Information(("a", "b"), np.array([[4.0, 2.0], [2.0, 4.0]]))
    assert pair.std_errors() == {"a": pytest.approx(np.sqrt(1 / 3)), "b": pytest.approx(np.sqrt(1 / 3))}


def test_a_parameter_that_nothing_shows_leaves_the_errors_of_the_others_as_they_are():
    known = Information(("a", "b"), np.array([[4.0, 1.0], [1.0, 9.0]]))
    padded = np.zeros((3, 3))
    padded[:2, :2] = known.matrix
    errors = Information(("a", "b", "c"), padded).std_errors()
    assert errors.pop("c") == np.inf
    assert errors == pytest.approx(known.std_errors())
