"""A run's own moment: found as far as the model's runs differed, said, and left alone where they did not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

from fieldsid.fitting.predict.own_moment import free_run, moment_note
from fieldsid.fitting.predict.predict import frozen_problem, predict
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import record_of
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.noise.white_floor import white_noise_floor

ANGLE, RATE, SPEED, STD = 0.003, 0.003, 1.5, 4e-4
PITCH = Physics(damping=1.2, stiffness=0.1, authority=0.8, nominal_speed=SPEED)


def a_model(std: float = STD, *, axis: Axis = Axis.PITCH, trim_of_fin: bool = False) -> Model:
    values = {"c22": 1.2, "c23": 0.1, "d2": 0.8, "Cb": 0.0} if axis is Axis.PITCH else {"a22": 1.2, "b2": 0.8, "C0": 0.0}
    law = SpeedLaw(SPEED, trim_of_fin=trim_of_fin)
    return Model(axis, (), values, {}, (), np.zeros((0, 0)), law, Noise(ANGLE, RATE, own_moment=std))


def logged(moment: float, *, axis: Axis = Axis.PITCH, seed: int = 1):
    hull = PITCH if axis is Axis.PITCH else Physics(damping=1.2, authority=0.8, nominal_speed=SPEED)
    clock = Clock(0.05, 1200)
    fin = maneuvers.zigzag(clock.time, 0.2, 0.6)
    log = flown(
        hull._replace(trim=moment), clock, fin, angle_noise=ANGLE, rate_noise=RATE, seed=seed, pitching=axis is Axis.PITCH
    )
    run = Run("run", log["time_s"], {k: v for k, v in log.items() if k != "time_s"})
    return replace(record_of(run, axis), speed=SPEED)


def errors(shown):
    return np.sqrt(np.mean(shown.residual**2, axis=1)) / (ANGLE, RATE)


@pytest.mark.parametrize("axis", Axis)
@pytest.mark.parametrize("moment", [6e-4, -7e-4])
def test_a_moment_of_the_runs_own_is_found_and_said(axis, moment):
    record = logged(moment, axis=axis)
    shown = predict(a_model(axis=axis, trim_of_fin=axis is Axis.YAW), record)
    assert shown.moment == pytest.approx(moment, abs=1.5e-4)
    assert (errors(shown) < 1.05).all()
    assert shown.as_logged is not None
    assert shown.as_logged[0] > 1.3 * ANGLE
    (note,) = [n for n in shown.notes if n.code == "own_moment"]
    assert f"{shown.moment:+.2g} rad/s^2" in note.message
    assert f"{STD:.2g} rad/s^2" in note.message


def test_a_moment_that_is_usual_from_run_to_run_is_not_told_of():
    shown = predict(a_model(), logged(2e-4))
    assert 0.0 < abs(shown.moment) < STD
    assert not [n for n in shown.notes if n.code == "own_moment"]


def test_a_model_whose_runs_did_not_differ_leaves_the_trim_where_it_is():
    shown = predict(a_model(0.0), logged(6e-4))
    assert shown.moment == 0.0
    assert not [n for n in shown.notes if n.code == "own_moment"]
    assert errors(shown)[0] > 1.3


def test_a_moment_far_beyond_what_runs_differ_by_is_not_taken_for_one():
    """A wrong model leaves a long residual, which has little weight beside the prior."""
    shown = predict(a_model(1e-5), logged(0.01))
    assert abs(shown.moment) < 1e-3
    assert errors(shown)[0] > 5.0


def test_the_response_is_what_another_trim_does_where_the_start_moves_along():
    record = logged(0.0)
    problem, x = frozen_problem(a_model(), record, ())
    residual, floor = problem.residual(x, 0)[0], white_noise_floor([record])
    run = free_run(problem, x, 0, residual, floor)
    weight = run.weight
    trim = problem.layout.names.index("Cb")
    moved = x.copy()
    moved[trim] += 1e-3
    change = (residual - problem.residual(moved, 0)[0]) / 1e-3
    start = np.stack([s for c, s in zip(*_starts(problem, x), strict=True) if c >= problem.layout.shared])
    scale = 1.0 / np.array([[floor.angle], [floor.rate]])
    left = (change - run.response).reshape(-1)
    fitted = np.linalg.lstsq(start.reshape(2, -1).T, left, rcond=None)[0]
    assert np.abs(left - fitted @ start.reshape(2, -1)).max() < 1e-6 * np.abs(change).max()
    assert np.abs((start * scale).reshape(2, -1) @ (run.response * scale).ravel()).max() < 0.05 * np.linalg.norm(
        run.response * scale
    ) * (np.linalg.norm((start * scale).reshape(2, -1), axis=1).max())
    assert weight.shape == (2, 1)


def _starts(problem, x):
    result = problem.linearise(x, 0)
    return result.columns, result.sensitivity


def test_the_moment_is_the_minimum_of_what_the_page_says():
    record = logged(5e-4)
    problem, x = frozen_problem(a_model(), record, ())
    run = free_run(problem, x, 0, problem.residual(x, 0)[0], white_noise_floor([record]))
    tried = np.linspace(-1e-3, 2e-3, 3001)
    cost = [float(np.sum(((run.residual - m * run.response) * run.weight) ** 2) + (m / STD) ** 2) for m in tried]
    assert run.own_moment(STD) == pytest.approx(tried[int(np.argmin(cost))], abs=1e-6)
    for std in (0.0, STD):
        left = (run.residual - run.own_moment(std) * run.response)[record.ok].reshape(2, -1)
        np.testing.assert_allclose(run.squares(std), np.sum(left**2, axis=1), rtol=1e-9)
    np.testing.assert_array_equal(run.counts, record.ok.sum(axis=1))


def test_a_motion_without_bound_has_no_moment_of_its_own():
    record = logged(0.0)
    model = a_model()
    problem, x = frozen_problem(replace(model, values={**model.values, "c22": -9.0, "c23": -20.0}), record, ())
    x[problem.layout.names.index("c22")] = -100.0
    residual = np.ones((2, len(record)))
    run = free_run(problem, x, 0, residual, white_noise_floor([record]))
    assert run.own_moment(STD) == 0.0
    np.testing.assert_allclose(run.squares(STD), np.sum(residual**2, axis=1))


def test_next_to_nothing_is_not_told():
    record = logged(0.0)
    assert moment_note(record, 0.05 * STD, STD) is None
    assert moment_note(record, 0.0, 0.0) is None
