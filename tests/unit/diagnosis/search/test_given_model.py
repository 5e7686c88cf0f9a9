"""A search that begins from a model in a file: its optimum is kept where a fit of its own ended at a worse one."""

from __future__ import annotations

from dataclasses import replace

import hidden_lag
import pytest

from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem
from fieldsid.diagnosis.evidence.scored_model import score_model
from fieldsid.diagnosis.search.given_model import refitted_from
from fieldsid.diagnosis.search.search import Search
from fieldsid.effects import pick_effect
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of


@pytest.fixture(scope="module")
def work():
    train, unseen = hidden_lag.runs()
    records = tuple(record_of(run, Axis.YAW) for run in train)
    effects = [pick_effect("servo_lag")]
    return Search(records, (record_of(unseen, Axis.YAW),), Axis.YAW, effects, ("servo_lag",))


def test_the_given_models_optimum_is_found_again_from_a_base_that_missed_it(work):
    best = work.base()
    fitted = best.likelihood_fit.fitted
    lost = FittedProblem(fitted.problem, fitted.problem.start(), fitted.weights)
    poor = score_model(replace(best.likelihood_fit, fitted=lost, log_likelihood=best.log_likelihood - 1000.0), work.validation)
    again = refitted_from(best.model, poor, work.grounds)
    assert again.log_likelihood == pytest.approx(best.log_likelihood, abs=0.5)
    assert again.model.values["lag"] == pytest.approx(best.model.values["lag"], rel=0.01)


def test_a_worse_model_changes_nothing(work):
    best = work.base()
    other = replace(best.model, values={**best.model.values, "lag": 1.5})
    assert refitted_from(other, best, work.grounds).log_evidence >= best.log_evidence
