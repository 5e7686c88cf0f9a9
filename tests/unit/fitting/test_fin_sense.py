"""Which way the fin turns is told by a regression where a fit leaves the authority open, and only there."""

from __future__ import annotations

import numpy as np
import pytest
from truth.paper import YAW, paper_run

from fieldsid.fitting.fin_sense import fin_sense
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of


def problem_of(change=lambda log: log, seed=1):
    log = change(paper_run(YAW[2], angle_noise=0.005, rate_noise=0.005, seed=seed))
    time = log.pop("time_s")
    record = record_of(Run("run", time, log), Axis.YAW)
    return Problem((record,), layout_of([record], Axis.YAW, ()))


def solution_of(problem, std_error):
    layout = problem.layout
    x = np.array([s.start for s in layout.parameters])
    x[layout.names.index("b2")] = 1.0
    return Solution(x, np.diag(np.full(layout.shared, std_error**2)), Noise(0.005, 0.005), "output_error")


def turned(log):
    return log | {"rudder_rad": -log["rudder_rad"]}


@pytest.mark.parametrize(("change", "sign"), [(dict, -1.0), (turned, 1.0)], ids=["as the paper has it", "the other way"])
def test_the_runs_tell_the_sign_whatever_the_fit_says(change, sign):
    problem = problem_of(change)
    found = fin_sense(problem, solution_of(problem, std_error=2.0))
    assert sign * found["fin_t"] > 5.0


def test_an_authority_that_is_clear_itself_needs_no_more():
    problem = problem_of()
    assert fin_sense(problem, solution_of(problem, std_error=0.1)) == {}


def test_a_fin_that_moves_nothing_tells_nothing():
    t_values = []
    for seed in range(12):
        rng = np.random.default_rng(seed)

        def still(log, rng=rng):
            noise = {n: 0.005 * rng.standard_normal(log["time_s"].size) for n in ("yaw_rad", "yaw_rate_rad_s")}
            return {"time_s": log["time_s"], "rudder_rad": log["rudder_rad"], "surge_m_s": log["surge_m_s"]} | noise

        problem = problem_of(still)
        t_values.append(fin_sense(problem, solution_of(problem, std_error=2.0))["fin_t"])
    assert np.sqrt(np.mean(np.square(t_values))) < 2.0


def test_a_fin_that_never_moves_or_that_a_controller_moves_gives_no_number():
    def held(log):
        return log | {"rudder_rad": np.zeros_like(log["rudder_rad"])}

    def steered(log):
        return log | {"rudder_rad": 0.5 * log["yaw_rad"] + 0.3 * log["yaw_rate_rad_s"]}

    for change in (held, steered):
        problem = problem_of(change)
        assert fin_sense(problem, solution_of(problem, std_error=2.0)) == {}
