"""The predictive likelihood against the average of the likelihood over what the training runs leave open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth.paper import YAW, paper_run

from fieldsid.diagnosis.evidence.likelihood_fit import LikelihoodFit, fit_output_error
from fieldsid.diagnosis.evidence.predictive_density import (
    ValidationRun,
    _density_and_residuals,
    _schur_complement,
    parameter_jacobian,
    precision,
)
from fieldsid.diagnosis.evidence.scored_model import bare_model, free_run_residual, validation_fits
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of, levenberg_marquardt
from fieldsid.fitting.predict.speed_correction import speed_sensitivity
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import part_of, record_of

NOISE = Noise(0.01, 0.01)


def record(row, seed, **change):
    log = paper_run(row, angle_noise=0.01, rate_noise=0.01, seed=seed)
    return replace(record_of(Run(f"run{seed}", log.pop("time_s"), log), Axis.YAW), **change)


@pytest.fixture(scope="module")
def judged():
    """A short run and a faster one leave the parameters in doubt."""
    runs = (part_of(record(YAW[1], 1, speed=1.0), slice(0, 220)), part_of(record(YAW[1], 2, speed=1.3), slice(0, 220)))
    layout = layout_of(runs, Axis.YAW, ())
    trial = fit_output_error(Problem(runs, layout), equation_error_start(runs, layout), NOISE)
    x = levenberg_marquardt(trial.problem, trial.x, NOISE).x
    return LikelihoodFit(replace(trial, x=x), NOISE, 0.0, "disturbance", NOISE)


def unseen(judged, log):
    model = bare_model(judged.fitted.problem, judged.fitted.x, NOISE)
    ((problem, x),) = validation_fits(model, judged.fitted, (log,))
    doubt = speed_sensitivity(problem, x, log.speed)
    return ValidationRun(
        problem, x, free_run_residual(problem, x), parameter_jacobian(judged, problem, log.speed), doubt, problem.linearise(x, 0)
    )


@pytest.mark.parametrize("speed", [1.0, 1.3])
def test_it_is_the_likelihood_averaged_over_what_the_training_runs_leave_open(judged, speed):
    run = unseen(judged, record(YAW[1], 7, speed=speed))
    dynamics = [(b.damping, b.stiffness) for b in [run.problem.base_of(run.x, 0)]]
    known = precision(judged)
    value, residuals = _density_and_residuals(NOISE, [run], dynamics, known)
    shared = run.problem.layout.shared
    rng = np.random.default_rng(3)
    drawn = rng.multivariate_normal(np.zeros(known.shape[0]), np.linalg.inv(known), 600)
    costs = []
    for d in drawn:
        x = run.x.copy()
        x[:shared] += run.parameter_jacobian @ d + run.speed * rng.standard_normal()
        costs.append(levenberg_marquardt(run.problem, x, NOISE, free=range(shared, x.size), max_iterations=4).cost)
    plain = cost_of(run.problem, run.x, NOISE)
    averaged = np.log(np.mean(np.exp(-0.5 * (np.array(costs) - plain))))
    at_estimate = _density_and_residuals(NOISE, [replace(run, speed=0.0 * run.speed)], dynamics, 1e12 * known)[0]
    assert value[0] - at_estimate[0] == pytest.approx(averaged, abs=0.3)
    assert abs(averaged) > 0.5
    assert np.sum((residuals[0] / 0.01) ** 2) < plain


def test_a_start_that_was_fitted_under_another_noise_costs_nothing(judged):
    run = unseen(judged, record(YAW[1], 7))
    dynamics, known = [(b.damping, b.stiffness) for b in [run.problem.base_of(run.x, 0)]], precision(judged)
    expected, residuals = _density_and_residuals(NOISE, [run], dynamics, known)
    bent = run.x.copy()
    bent[run.problem.layout.shared :] += 0.02
    moved = replace(run, x=bent, residual=free_run_residual(run.problem, bent), linearisation=run.problem.linearise(bent, 0))
    assert np.sum(moved.residual**2) > 1.5 * np.sum(run.residual**2)
    value, left = _density_and_residuals(NOISE, [moved], dynamics, known)
    assert value[0] == pytest.approx(expected[0], abs=0.1)
    np.testing.assert_allclose(left[0], residuals[0], atol=1e-4)


def test_the_shared_slots_of_a_run_move_as_the_law_says(judged):
    log = record(YAW[1], 7, speed=1.15)
    run, layout = unseen(judged, log), judged.fitted.problem.layout
    x = judged.fitted.x
    for j, name in enumerate(layout.names):
        step = 1e-3 * max(abs(x[j]), 1e-2)
        ends = []
        for s in (step, -step):
            moved = np.where(np.arange(x.size) == j, x + s, x)
            ((problem, own),) = validation_fits(bare_model(judged.fitted.problem, moved, NOISE), judged.fitted, (log,))
            own[problem.layout.shared :] = run.x[run.problem.layout.shared :]
            ends.append(problem.simulate(own, 0)[0].rate)
        slope = (ends[0] - ends[1]) / (2 * step)
        direct = np.zeros_like(slope)
        result = run.problem.linearise(run.x, 0)
        for i, slot in enumerate(result.columns):
            if slot < run.problem.layout.shared:
                direct += result.sensitivity[i, 1] * run.parameter_jacobian[slot, j]
        np.testing.assert_allclose(direct, slope, atol=2e-3 * np.abs(slope).max() + 1e-9, err_msg=name)


@pytest.mark.parametrize("apart", [1e-3, 1e-5, 1e-9])
def test_what_is_left_of_a_slot_that_a_runs_own_stand_in_for_is_never_negative(apart):
    t = np.linspace(0.0, 1.0, 400)
    own = np.stack([1e3 * np.ones(400), 1e-4 * t])
    beside = np.random.default_rng(3).standard_normal(400)
    columns = np.stack([1e6 * (1.0 + t + apart * beside), np.cos(9.0 * t), *own])
    left = beside - np.linalg.qr(own.T)[0] @ (np.linalg.qr(own.T)[0].T @ beside)
    known, _ = _schur_complement(columns @ columns.T, np.zeros(4), 2)
    exact = (1e6 * apart) ** 2 * float(left @ left)
    rounding = 1e-13 * float(columns[0] @ columns[0])
    assert known[0, 0] > 0.0
    assert known[0, 0] == pytest.approx(exact, rel=1e-3, abs=rounding)
