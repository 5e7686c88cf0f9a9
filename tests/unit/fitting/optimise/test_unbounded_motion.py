"""What runs away ends: a fit, a search and a noise model of a motion without bound have a reason, and never none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import runaway
from in_time import in_time

from fieldsid.diagnosis.evidence.likelihood_fit import fit_maximum_likelihood
from fieldsid.diagnosis.evidence.scored_model import score_model
from fieldsid.diagnosis.search.search import Search
from fieldsid.errors import DivergenceError
from fieldsid.fitting.fit import estimators, fit
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.optimise import levenberg_marquardt as levenberg_marquardt_module
from fieldsid.fitting.optimise.levenberg_marquardt import levenberg_marquardt
from fieldsid.fitting.optimise.unbounded_motion import refuse_unbounded_motion
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of
from fieldsid.noise.maximum_likelihood import estimate_noise, log_likelihood
from fieldsid.noise.noise_kinds import NOISE_KINDS, SINGLE_NOISE_KINDS
from fieldsid.noise.white_floor import WhiteBounds, white_noise_floor


@pytest.fixture(scope="module")
def away():
    """A record of minutes whose equations ask for a vehicle that runs away."""
    return record_of(runaway.flown(), Axis.PITCH)


@pytest.fixture(scope="module")
def well():
    """A record of the same vehicle as it is."""
    return record_of(runaway.flown("well", seconds=60.0, sign=1.0), Axis.PITCH)


def problem_of(*records):
    return Problem(records, layout_of(records, Axis.PITCH, ()))


def gone(problem):
    """Parameters whose motion grows without bound on every run."""
    x = equation_error_start(problem.records, problem.layout)
    x[problem.layout.names.index("c23")] = -15.0
    return x


BY_EQUATION = ("svf_ls", "svf_rls")
"""Methods whose numbers are those of the equations, whatever they do when they are simulated."""


@pytest.mark.parametrize("method", sorted(set(estimators()) - set(BY_EQUATION)))
def test_a_method_that_simulates_ends_with_numbers_on_a_log_of_the_wrong_sign(away, method):
    with in_time(60):
        found = fit([away], Axis.PITCH, method=method)
    assert np.isfinite(list(found.model.values.values())).all()
    assert np.isfinite(found.predictions[0].rate).all()


@pytest.mark.parametrize("method", BY_EQUATION)
def test_a_method_that_does_not_is_refused_with_the_run_named(away, method):
    with in_time(60), pytest.raises(DivergenceError, match="grows without bound when it is simulated on run 'runaway'") as error:
        fit([away], Axis.PITCH, method=method)
    assert "c23 = -" in error.value.found
    assert "--method output_error" in error.value.hint


def test_instruments_without_bound_are_refused(well):
    """An angle that was logged in counts is no motion."""
    with in_time(60), pytest.raises(DivergenceError, match="instrumental variables of run 'well' grow without bound"):
        fit([replace(well, angle=1e9 * well.angle, rate_ok=np.zeros(len(well), dtype=bool))], Axis.PITCH, method="srivc")


def test_a_search_begins_with_a_base_that_stays(away, well):
    with in_time(60):
        base = Search((away,), (well,), Axis.PITCH, ()).base()
    assert np.isfinite([base.log_evidence, base.train.mean, base.selection_errors.mean]).all()


def test_a_start_stays_within_bounds_where_the_equations_ask_for_one_that_does_not(away):
    problem = problem_of(away)
    x = equation_error_start(problem.records, problem.layout)
    assert np.isfinite(problem.simulate(x, 0)[0].rate).all()


def test_a_slow_instability_is_started_from_as_it_is():
    """What a free run follows over the whole record although it grows is no reason to start elsewhere."""
    falling = record_of(runaway.flown("falling", seconds=60.0, sign=1.0, c23=-0.03), Axis.PITCH)
    problem = problem_of(falling)
    assert equation_error_start([falling], problem.layout)[problem.layout.names.index("c23")] == pytest.approx(-0.03, abs=0.01)


@pytest.mark.parametrize("family", NOISE_KINDS)
def test_the_noise_of_a_motion_without_bound_has_no_likelihood(away, family):
    problem = problem_of(away)
    residual, _ = problem.residual(gone(problem), 0)
    assert not np.isfinite(residual).all()
    start = Noise(0.003, 0.003)
    with in_time(10):
        noise, likelihood = estimate_noise([away], [(1.0, 0.1)], [residual], family, start)
    assert (noise, likelihood) == (start, -np.inf)
    assert log_likelihood([away], [(1.0, 0.1)], [residual], start) == -np.inf


@pytest.mark.parametrize("family", SINGLE_NOISE_KINDS)
def test_a_start_that_runs_away_is_given_up_where_others_are(away, well, family):
    problem, floor = problem_of(away), white_noise_floor([away])
    with in_time(20):
        judged = fit_maximum_likelihood(problem, gone(problem), floor, WhiteBounds.near(floor), family)
        given_up = score_model(judged, (well,))
    assert judged.log_likelihood == given_up.log_evidence == -np.inf
    assert np.isfinite([given_up.train.mean, given_up.selection_errors.mean]).all()
    with in_time(60):
        search = Search((away,), (well,), Axis.PITCH, ())
        base = search.base()
    search.tried[frozenset({"what ran away"})] = given_up
    assert search.ranked() == [base]


def test_a_descent_from_there_stays_there_and_says_so(away):
    problem = problem_of(away)
    with in_time(10):
        found = levenberg_marquardt(problem, gone(problem), white_noise_floor([away]))
    assert found.cost == np.inf
    assert not found.converged
    with pytest.raises(DivergenceError, match="grows without bound when it is simulated on run 'runaway'"):
        refuse_unbounded_motion(problem, found.x, "output_error", instead="leave effects out")


class Cliff:
    """A cost that is next to flat where the first number is above a half, and has no bounds below."""

    def linear(self, x):
        normal, gradient = np.diag([1e-3, *np.ones(x.size - 1)]), np.zeros(x.size)
        gradient[0] = -1e-2
        return (1e3 if x[0] > 0.5 else np.inf), normal, gradient


def test_a_descent_looks_where_a_long_step_leads_before_it_ends_there(well, monkeypatch):
    """What the data hardly hold is promised next to nothing for a step far away, where the equations no longer hold."""
    problem, cliff = problem_of(well), Cliff()
    monkeypatch.setattr(levenberg_marquardt_module, "linear_white", lambda *_of: cliff)
    start = equation_error_start(problem.records, problem.layout)
    found = levenberg_marquardt(problem, start, white_noise_floor([well]), tolerance=1e-3)
    assert found.cost == cliff.linear(found.x)[0]
