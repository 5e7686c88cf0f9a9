"""The search by the free run: what is hidden is found in logs without noise, and nothing idle stays beside it."""

from __future__ import annotations

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

from fieldsid.diagnosis.evidence.likelihood_fit import fit_output_error
from fieldsid.diagnosis.search.noiseless_search import (
    Explored,
    _backward_eliminate,
    _evaluate,
    noiseless_line,
    noiseless_search,
)
from fieldsid.diagnosis.search.search import Search
from fieldsid.diagnosis.thresholds import MAX_FREE_RUN_ERROR_RATIO
from fieldsid.diagnosis.verdict import added_effects
from fieldsid.effects import pick_effect
from fieldsid.fitting.initial.effect_screen import with_effect
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

CLOCK = Clock(0.1, 500)
HIDDEN = Physics(damping=0.9, authority=-0.7, fin_bend=-0.01, kp=0.9, kd=0.5, servo_tau=0.5, quadratic=4.0)
TRIED = ("servo_lag", "quadratic_damping", "delay", "gyro_bias", "asymmetric_fin")


@pytest.fixture(scope="module")
def work():
    """A search over three runs, two of them fitted to, without noise."""
    records, rng = [], np.random.default_rng(4)
    plans = (
        maneuvers.zigzag(CLOCK.time, 0.25, 0.4),
        maneuvers.multisine(CLOCK.time, rng, 0.25),
        maneuvers.zigzag(CLOCK.time, 0.15, 0.3),
    )
    for i, plan in enumerate(plans):
        log = flown(HIDDEN, CLOCK, plan)
        log = {k: log[k] for k in ("time_s", "yaw_rad", "yaw_rate_rad_s", "rudder_rad")}
        records.append(record_of(Run(f"run{i}", log.pop("time_s"), log), Axis.YAW))
    return Search(records[:2], records[2:], Axis.YAW, [pick_effect(n) for n in TRIED])


def test_both_hidden_effects_are_found_and_what_each_lacks_is_known(work):
    found = noiseless_search(work, lambda _h: True)
    assert set(found.names) == {"servo_lag", "quadratic_damping"}
    assert found.selection_errors.mean < 0.05 * work.base().selection_errors.mean
    first, second = added_effects(work, found)
    alone = {n: work.tried[frozenset({n})].selection_errors.mean for n in (first, second)}
    assert alone[first] < alone[second]


def test_the_models_of_a_line_are_those_of_the_search(work):
    found = noiseless_search(work, lambda _h: True)
    line = noiseless_line(work, [frozenset(), frozenset({"servo_lag"}), frozenset(found.names)])
    assert [set(h.names) for h in line] == [set(), {"servo_lag"}, set(found.names)]
    assert line[0].train.mean > line[1].train.mean > line[2].train.mean
    assert line[2].selection_errors.mean == pytest.approx(found.selection_errors.mean, rel=0.05)


def test_a_model_with_one_effect_more_is_not_less_likely(work):
    bare, whole = noiseless_line(work, [frozenset(), frozenset({"gyro_bias"})])
    assert whole.likelihood_fit.log_likelihood > bare.likelihood_fit.log_likelihood - 0.5


def test_an_effect_that_the_others_have_made_idle_is_left_out(work):
    whole = noiseless_search(work, lambda _h: True).output_error_fit
    problem, x = with_effect(whole.problem, whole.x, pick_effect("gyro_bias"), {})
    more = _evaluate(work, fit_output_error(problem, x, whole.weights))
    best, less = _backward_eliminate(work, more, Explored())
    assert set(best.output_error_fit.names) == {"servo_lag", "quadratic_damping"}
    assert len(less) == 2
    assert all(best.error_ratio <= MAX_FREE_RUN_ERROR_RATIO * f.error_ratio for f in less)


def test_a_number_of_each_runs_own_is_charged_as_an_effect_is(work):
    base = work.base().reported_fit
    problem, x = with_effect(base.problem, base.x, pick_effect("wave"), {})
    waved = _evaluate(work, fit_output_error(problem, x, base.weights))
    assert waved.charge == pytest.approx(MAX_FREE_RUN_ERROR_RATIO**-3)  # a phase in each of three runs
    assert _evaluate(work, base).charge == 1.0
