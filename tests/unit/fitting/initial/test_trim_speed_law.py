"""A bent fin's trim at several speeds: the same fin angle at every one, exact slopes, found again, and told from a moment."""

from __future__ import annotations

import numpy as np
import pytest
from short_way import compare_with_the_general_core
from truth.paper import YAW, paper_run

from fieldsid.diagnosis.search.search import Search
from fieldsid.fitting.fit import fit
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise, load_model, save_model
from fieldsid.models.record import record_of

ANGLE, RATE = 0.002, 0.004
OFFSET = 0.012
GRIP = {1.0: 0.9, 1.4: 1.0, 1.9: 1.08}
"""Authority over that of the square law, by speed: it need not follow it."""


def flown(speed, *, bent, seed):
    share = speed / 1.4
    authority = -0.9 * share**2 * GRIP[speed]
    trim = authority * OFFSET if bent else -0.9 * OFFSET
    row = YAW[1]._replace(speed=speed, a22=1.1 * share, b2=authority, C0=trim)
    log = paper_run(row, angle_noise=ANGLE, rate_noise=RATE, seed=seed)
    return record_of(Run(f"run{seed}", log.pop("time_s"), log), Axis.YAW)


def runs(*, bent):
    return [flown(speed, bent=bent, seed=seed) for seed, speed in enumerate(GRIP, 1)]


def test_slopes_of_a_trim_that_goes_with_the_authority_are_those_of_the_free_run():
    records = runs(bent=True)
    problem = Problem(tuple(records), layout_of(records, Axis.YAW, ()))
    x = equation_error_start(problem.records, problem.layout)
    x[problem.layout.names.index("C0")] = -0.3
    for run in range(3):
        result = problem.linearise(x, run)
        for slot, mine in zip(result.columns, result.sensitivity, strict=True):
            step = 1e-5 * max(abs(x[slot]), 0.1)
            ends = [problem.residual(np.where(np.arange(x.size) == slot, x + s, x), run)[0] for s in (step, -step)]
            slope = -(ends[0] - ends[1]) / (2 * step)
            assert np.abs(mine - slope).max() < 1e-5 * (np.abs(slope).max() + 1e-3), problem.layout.parameters[slot].name


def test_the_short_way_has_the_same_normal_equations():
    records = runs(bent=True)
    problem = Problem(tuple(records), layout_of(records, Axis.YAW, ()))
    x = equation_error_start(problem.records, problem.layout)
    x[problem.layout.names.index("C0")] = -0.3
    compare_with_the_general_core(problem, x, Noise(ANGLE, RATE), gradient_near=1e-8)


def test_a_joint_fit_finds_one_offset_for_all_speeds_and_keeps_it_in_its_file(tmp_path):
    model = fit(runs(bent=True), Axis.YAW).model
    again = load_model(save_model(model, tmp_path / "m.yaml"))
    for speed in GRIP:
        here = again.at_speed(speed)
        assert here["C0"] / here["b2"] == pytest.approx(OFFSET, abs=6e-4)


def test_a_joint_fit_keeps_a_moment_that_is_the_same_at_all_speeds():
    model = fit(runs(bent=False), Axis.YAW).model
    assert not model.law.trim_of_fin
    assert [model.at_speed(u)["C0"] for u in GRIP] == pytest.approx([-0.9 * OFFSET] * 3, abs=1e-3)


@pytest.mark.parametrize("bent", [True, False])
def test_the_diagnosis_finds_which_law_the_trim_follows(bent):
    base = Search(runs(bent=bent), [flown(1.9, bent=bent, seed=9)], Axis.YAW, ()).base()
    assert base.likelihood_fit.fitted.problem.layout.groups.trim_of_fin is bent
    assert base.validation_errors.over(Noise(ANGLE, RATE)) < 1.2
