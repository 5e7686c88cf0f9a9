"""A run's own speed: found where the log's is a little off, never moved by more than a measurement may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

from fieldsid.fitting.predict import speed_correction
from fieldsid.fitting.predict.predict import frozen_problem, predict, refit_nuisances
from fieldsid.fitting.predict.speed_correction import (
    MAX_STD_ERRORS,
    MEASURED_SPEED_STD_ERROR,
    correct_speed,
    error_of_speed,
    speed_note,
)
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import record_of
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.noise.white_floor import white_noise_floor

SPEED, ANGLE, RATE = 1.5, 0.003, 0.003
TAKEN = "the standard error of 0.3 % that a measured speed is taken to have"
FINDING = "the scale of its speed is probably off, or the model is at this speed"
HULL = Physics(damping=0.8, authority=-0.6, nominal_speed=SPEED)
TRUE = Model(
    Axis.YAW, (), {"a22": 0.8, "b2": -0.6, "C0": 0.0}, {}, (), np.zeros((0, 0)), SpeedLaw(SPEED), Noise(ANGLE, RATE)
)  # fmt: skip


def logged(faster, *, seed=1, gust=0.0):
    """A run as flown, in a log whose speed is short by that share."""
    clock = Clock(0.05, 1200)
    log = flown(HULL, clock, maneuvers.zigzag(clock.time, 0.3, 0.8), angle_noise=ANGLE, rate_noise=RATE, gust=gust, seed=seed)
    record = record_of(Run("run", log["time_s"], {k: v for k, v in log.items() if k != "time_s"}), Axis.YAW)
    return replace(record, speed=SPEED / (1.0 + faster))


def errors(shown):
    return np.sqrt(np.mean(shown.residual**2, axis=1)) / (ANGLE, RATE)


def test_the_error_that_a_measured_speed_makes_is_the_change_of_the_flight_with_it():
    clock, faster = Clock(0.05, 1200), 1.0 + MEASURED_SPEED_STD_ERROR
    plan = maneuvers.multisine(clock.time, np.random.default_rng(4), 0.2)  # the same fin at both speeds
    first, other = (flown(hull, clock, plan) for hull in (HULL, HULL._replace(damping=0.8 * faster, authority=-0.6 * faster**2)))
    record = record_of(Run("run", first["time_s"], {k: v for k, v in first.items() if k != "time_s"}), Axis.YAW)
    found = error_of_speed(*frozen_problem(TRUE, replace(record, speed=SPEED), ()))
    angle, rate = (np.sqrt(np.mean((other[k] - first[k]) ** 2)) for k in ("yaw_rad", "yaw_rate_rad_s"))
    assert (found.angle, found.rate) == pytest.approx((angle, rate), rel=0.1)


@pytest.mark.parametrize("faster", [0.006, -0.004])
def test_a_speed_that_is_a_little_off_is_found_and_said(faster):
    record = logged(faster)
    shown = predict(TRUE, record)
    assert shown.faster == pytest.approx(faster, abs=0.001)
    assert (errors(shown) < 1.06).all()
    assert shown.as_logged is not None
    assert shown.as_logged[0] > 1.3 * ANGLE
    note = speed_note(record, shown.faster)
    assert note is not None
    assert f"{100 * abs(shown.faster):.2f} % {'faster' if faster > 0 else 'slower'}" in note.message


@pytest.mark.parametrize(
    ("faster", "ends"),
    [
        (0.0051, f"1.7 x {TAKEN}"),
        (0.0077, f"2.6 x {TAKEN}: {FINDING}"),
        (-0.009, f"3.0 x {TAKEN} (0.9 % is the most it is moved by): {FINDING}"),
    ],
)
def test_a_speed_moved_further_than_it_should_be_is_a_finding(faster, ends):
    note = speed_note(logged(0.0), faster)
    assert note is not None
    assert note.message.endswith(ends)
    assert "known to" not in note.message


def test_a_heading_once_a_second_and_no_rate_tell_the_speed_as_well():
    record = logged(0.006)
    seen = np.arange(len(record)) % 20 == 0
    shown = predict(TRUE, replace(record, angle_ok=seen, rate_ok=np.zeros(len(record), dtype=bool)))
    assert shown.faster == pytest.approx(0.006, abs=0.002)


def test_a_speed_that_is_right_is_left_where_it_is():
    shown = predict(TRUE, logged(0.0))
    assert abs(shown.faster) < 0.001
    assert shown.as_logged is None
    assert speed_note(shown.record, shown.faster) is None


@pytest.mark.parametrize("errors", [-0.9, 0.9, 1.1, -1.1])
def test_a_speed_within_an_error_of_its_measurement_is_no_note(errors):
    note = speed_note(logged(0.0), errors * MEASURED_SPEED_STD_ERROR)
    assert (note is None) is (abs(errors) < 1.0)


def test_a_speed_is_moved_by_three_errors_of_its_measurement_at_most():
    shown = predict(TRUE, logged(0.05))
    assert 2.0 * MEASURED_SPEED_STD_ERROR < shown.faster <= MAX_STD_ERRORS * MEASURED_SPEED_STD_ERROR
    assert errors(shown)[0] > 3.0


def test_a_speed_that_nobody_measured_stays_so():
    shown = predict(TRUE, replace(logged(0.006), speed=float("nan")))
    assert shown.faster == 0.0


def test_the_speed_found_is_at_the_minimum_of_what_the_page_says():
    record = logged(0.006, gust=0.05)
    floor = white_noise_floor([record])
    problem, x = frozen_problem(TRUE, record, ())
    x = refit_nuisances(problem, x, 0, floor)
    moved, own, faster = correct_speed(problem, x, floor)
    weight = speed_correction.channel_weights(record, moved.residual(own, 0)[0], floor)[:, None]
    free = list(problem.layout.nuisances_of(0))

    def cost(v):
        at = x.copy()
        at[free] = v[:-1]
        residual, _ = speed_correction._at_speed_share(problem, MEASURED_SPEED_STD_ERROR * v[-1]).residual(at, 0)
        return float(np.sum((weight * residual) ** 2) + v[-1] ** 2)

    start = np.append(own[free], faster / MEASURED_SPEED_STD_ERROR)
    best = minimize(cost, start, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9, "maxiter": 4000})
    assert faster / MEASURED_SPEED_STD_ERROR == pytest.approx(best.x[-1], abs=0.05)


def test_what_a_wrong_model_leaves_moves_the_speed_less_than_it_would_alone():
    wrong = replace(TRUE, values={**TRUE.values, "C0": 0.01})
    record = logged(0.0)
    assert errors(predict(wrong, record))[0] > 5.0
    assert abs(predict(wrong, record).faster) < MAX_STD_ERRORS * MEASURED_SPEED_STD_ERROR


@pytest.mark.parametrize(("gust", "share_left"), [(0.0, 0.2), (0.003, 0.7), (0.03, 1.1)])
def test_speeds_are_found_better_than_they_were_measured_unless_gusts_say_more(gust, share_left):
    shares = MEASURED_SPEED_STD_ERROR * np.random.default_rng(5).standard_normal(12)
    found = np.array([predict(TRUE, logged(share, seed=i, gust=gust)).faster for i, share in enumerate(shares)])
    assert np.sqrt(np.mean((found - shares) ** 2)) < share_left * MEASURED_SPEED_STD_ERROR


def test_a_run_flown_after_a_loss_is_predicted_with_the_loss_throughout():
    values = {**TRUE.values, "loss": 0.07, "moment_step": 0.0}
    model = replace(TRUE, effects=("step_change",), values=values)
    lost = HULL._replace(authority=(1.0 - 0.07) * HULL.authority)
    clock = Clock(0.05, 2600)
    for seed in range(4):
        log = flown(lost, clock, maneuvers.stairs(clock.time), angle_noise=ANGLE, rate_noise=RATE, seed=seed)
        record = record_of(Run("run", log["time_s"], {k: v for k, v in log.items() if k != "time_s"}), Axis.YAW)
        shown = predict(model, replace(record, speed=SPEED))
        assert shown.nuisance["event_time"] < 0.08
        assert (errors(shown) < 1.06).all()


def test_a_step_that_raises_the_cost_is_not_taken(monkeypatch):
    record = logged(0.006)
    floor = white_noise_floor([record])
    problem, x = frozen_problem(TRUE, record, ())
    x = refit_nuisances(problem, x, 0, floor)
    far = speed_correction._step

    def wild(*of):
        step = far(*of)
        return replace(step, change=step.change * -50.0)

    monkeypatch.setattr(speed_correction, "_step", wild)
    moved, own, faster = correct_speed(problem, x, floor)
    assert faster == 0.0
    assert (own == x).all()
    assert moved is problem
