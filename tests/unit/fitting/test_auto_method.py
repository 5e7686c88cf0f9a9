"""`auto` takes prediction error where a disturbance moves the vehicle, and output error where an effect is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.paper import DEG
from truth.physics import Physics

from fieldsid.fitting import auto_method
from fieldsid.fitting.fit import estimators, fit
from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
from fieldsid.fitting.predict.predict import predict
from fieldsid.fitting.problem.estimator import Options
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.fitting.specification import agreement, independence
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import Record, record_of

CLOCK = Clock(0.05, 1200)
BASE = {"damping": 0.6, "authority": -0.5, "trim": 0.004, "kp": 0.8, "kd": 1.0}
LAG = {"servo_tau": 0.4}
SWAY = {"cross_rate": 0.5, "cross_damping": 0.6, "cross_moment": 0.8}
GUST = 0.02


def record(seed: int, hidden: dict[str, float], gust: float) -> Record:
    """A minute of pulses, a zig-zag or a random fin in turn; sensors of 0.3 deg and deg/s, a gust of 1 s."""
    t, rng = CLOCK.time, np.random.default_rng(seed)
    plans = (
        lambda: maneuvers.pulses(t, recovery=9.0),
        lambda: maneuvers.zigzag(t, 0.2, 0.2),
        lambda: maneuvers.prbs(t, rng, 0.2),
    )
    noise = {"angle_noise": 0.3 * DEG, "rate_noise": 0.3 * DEG}
    log = flown(Physics(**(BASE | hidden)), CLOCK, plans[seed % 3](), gust=gust, seed=seed, **noise)
    return record_of(Run("flown", log.pop("time_s"), log), Axis.YAW)


def problem_of(log: Record) -> Problem:
    return Problem((log,), layout_of([log], log.axis, ()))


def solved(log: Record, method: str):
    problem = problem_of(log)
    return problem, estimators()[method].solve(problem, Options())


def reason(found) -> list[str]:
    return [n.message for n in found.notes if n.code == "method_chosen"]


def test_a_disturbance_is_fitted_by_prediction_error_whose_numbers_are_nearer_the_truth():
    off = {"auto": [], "output_error": []}
    for seed in range(20, 29):
        log = record(seed, {}, GUST)
        for method, list_ in off.items():
            found = fit([log], Axis.YAW, method=method)
            list_.append([found.model.values["a22"] / 0.6 - 1.0, found.model.values["b2"] / -0.5 - 1.0])
            if method == "auto":
                assert found.model.method == "pem"
                (why,) = reason(found)
                assert why.startswith("`auto` took prediction error: a disturbance explains")
    assert (np.std(off["auto"], axis=0) < 0.7 * np.std(off["output_error"], axis=0)).all()


@pytest.mark.parametrize("flights", [3, pytest.param(9, marks=pytest.mark.slow)])
def test_a_missing_effect_is_not_taken_for_a_disturbance(flights):
    for hidden in (LAG, SWAY):
        for seed in range(20, 20 + flights):
            found = fit([record(seed, hidden, 0.0)], Axis.YAW)
            assert found.model.method == "output_error"
            (why,) = reason(found)
            assert "follows fin and motion" in why or "the motion's own mean" in why


@pytest.mark.slow
def test_a_missing_lag_at_sea_leaves_prediction_error_only_with_a_free_run_nearly_as_good():
    taken = []
    for seed in range(20, 29):
        log = record(seed, LAG, GUST)
        found, other = fit([log], Axis.YAW), fit([log], Axis.YAW, method="pem")
        taken.append(found.model.method)
        (note,) = [n for n in found.notes if n.code == "method_chosen"]
        if found.model.method == "pem":
            assert note.data["free_run_ratio"] <= auto_method.MAX_FREE_RUN_RATIO
        else:
            assert goodness_of_fit(found.predictions).rate_fit > goodness_of_fit(other.predictions).rate_fit
    assert taken.count("output_error") >= 6


def test_a_missing_sway_makes_the_two_methods_differ():
    problem, refined = solved(record(20, SWAY, 0.0), "pem")
    assert agreement(problem, refined.x, refined.noise) < auto_method.MIN_P_VALUE


def test_both_tests_keep_their_level_under_a_disturbance():
    p = []
    for seed in range(20, 32):
        problem, refined = solved(record(seed, {}, GUST), "pem")
        p.append((agreement(problem, refined.x, refined.noise), independence(problem, refined.x, refined.noise)))
    # of 12 flights one in ten seldom has more than four
    assert (np.sum(np.array(p) < 0.1, axis=0) <= 4).all()
    assert (np.array(p) >= auto_method.MIN_P_VALUE).all()


def test_where_no_disturbance_shows_prediction_error_is_not_sought():
    def refine():
        pytest.fail("sought")

    problem, plain = solved(record(21, {}, 0.0), "output_error")
    assert auto_method.choose(problem, plain, refine) is plain


def test_a_free_run_no_better_than_the_mean_is_refused(monkeypatch):
    problem, plain = solved(record(21, {}, GUST), "output_error")
    for name in ("agreement", "independence"):
        monkeypatch.setattr(auto_method, name, lambda *_: 1.0)
    reversed_ = plain.x.copy()
    reversed_[problem.layout.names.index("b2")] *= -1.0
    found = auto_method.choose(problem, plain, lambda: replace(plain, x=reversed_, method="pem"))
    assert found.method == "output_error"
    (why,) = reason(found)
    assert "times as far off as the motion's own mean" in why


def test_the_free_run_shown_of_prediction_error_is_that_of_its_best_start():
    log = record(21, {}, GUST)
    found = fit([log], Axis.YAW, method="pem")
    again = predict(found.model, log)
    assert goodness_of_fit(found.predictions).angle_fit == pytest.approx(goodness_of_fit([again]).angle_fit, abs=0.5)
