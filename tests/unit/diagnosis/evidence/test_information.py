"""The effective sample sizes against projected sensitivities written out, and what they are for known effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth.paper import YAW, paper_run

from fieldsid.diagnosis.evidence.information import FEWEST, information
from fieldsid.diagnosis.evidence.likelihood_fit import fit_output_error
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.effect import effect_named
from fieldsid.models.model import Noise
from fieldsid.models.record import part_of, record_of
from fieldsid.noise.whiten import whiten

WHITE = Noise(0.01, 0.01)
GUSTY = replace(WHITE, disturbance=0.01, disturbance_time=5.0)


def problem_with(*names, steps=600):
    """A problem of two runs with some effects, and a vector near its minimum."""
    logs = [paper_run(YAW[1], angle_noise=0.01, rate_noise=0.01, seed=seed) for seed in (1, 2)]
    runs = tuple(
        part_of(record_of(Run(f"run{i}", log.pop("time_s"), log), Axis.YAW), slice(0, steps)) for i, log in enumerate(logs)
    )
    effects = [effect_named(n) for n in names]
    layout = layout_of(runs, Axis.YAW, effects)
    start = np.where(equation_error_start(runs, layout) == 0.0, 1e-3, equation_error_start(runs, layout))
    found = fit_output_error(Problem(runs, layout), start, WHITE)
    return found.problem, found.x


def sizes(problem, x, noise):
    return dict(zip(problem.layout.names, information(problem, x, noise).sample_sizes.tolist(), strict=True))


@pytest.mark.parametrize("noise", [WHITE, GUSTY])
def test_it_is_what_the_projected_sensitivities_give(noise):
    problem, x = problem_with("gyro_bias", "servo_lag")
    rows = []
    for run, record in enumerate(problem.records):
        result = problem.linearise(x, run)
        white, _ = whiten(record, noise, result.base.damping, result.base.stiffness, result.sensitivity)
        full = np.zeros((white[0].size, x.size))
        full[:, list(result.columns)] = white.reshape(white.shape[0], -1).T
        rows.append(full)
    s = np.vstack(rows)
    found = information(problem, x, noise).sample_sizes
    for j in range(problem.layout.shared):
        others = np.delete(s, j, axis=1)
        others = others / np.linalg.norm(others, axis=0)
        left = s[:, j] - others @ np.linalg.lstsq(others, s[:, j], rcond=None)[0]
        assert found[j] == pytest.approx(np.sum(left**2) / np.max(left**2), rel=1e-3)


def test_a_constant_shift_rests_on_nearly_every_sample_and_a_lag_on_those_after_a_step():
    problem, x = problem_with("gyro_bias", "servo_lag")
    found, count = sizes(problem, x, WHITE), sum(int(r.rate_ok.sum()) for r in problem.records)
    assert 0.3 * count < found["bias"] <= 1.5 * count
    assert FEWEST < found["lag"] < 0.5 * found["bias"]


def test_a_slow_disturbance_leaves_a_steady_moment_fewer_measurements():
    problem, x = problem_with()
    assert sizes(problem, x, GUSTY)["C0"] < sizes(problem, x, WHITE)["C0"]


def test_it_does_not_depend_on_the_unit_of_a_parameter():
    problem, x = problem_with("gyro_bias")
    turned = sizes(problem, x, replace(WHITE, angle=0.02, rate=0.02))
    assert turned == pytest.approx(sizes(problem, x, WHITE), rel=1e-6)
