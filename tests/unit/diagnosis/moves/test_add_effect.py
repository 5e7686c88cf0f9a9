"""The screen of additions: an effect comes before another by what it gains beyond the price of its numbers."""

from __future__ import annotations

from types import SimpleNamespace

import hidden_lag
import pytest

from fieldsid.diagnosis.moves.add_effect import Addition, _price, _Screen
from fieldsid.models.axis import Axis
from fieldsid.models.effect import effect_named
from fieldsid.models.record import record_of

COST = 1000.0
DRIFT, EVENT = effect_named("trim_drift"), effect_named("step_change")


@pytest.fixture(scope="module")
def parent():
    """What a screen asks of a model: its runs, and how much of all of them is fitted."""
    records = [record_of(run, Axis.YAW) for run in hidden_lag.runs()[0]]
    fitted = SimpleNamespace(problem=SimpleNamespace(records=records))
    return SimpleNamespace(likelihood_fit=SimpleNamespace(fitted=fitted), validation=(), training_share=1.0)


def first_of(parent, drift, event):
    """The effect that is tried where one place is left, by what drift and event lower the cost."""
    screen = _Screen(Addition(parent, (DRIFT, EVENT), most=1), SimpleNamespace(cost=COST), by_output_error=False)
    points = [[SimpleNamespace(effect=e, predicted_cost=COST - fall)] for e, fall in ((EVENT, event), (DRIFT, drift))]
    (step,) = screen.steps(points)
    return step.evaluate.args[1][0].effect.name


def test_an_event_in_each_run_comes_before_a_drift_only_where_it_pays_for_its_times(parent):
    price = _price(parent, EVENT)
    assert _price(parent, DRIFT) == 0.0 < price
    assert first_of(parent, 100.0, 100.0 + 0.9 * price) == "trim_drift"
    assert first_of(parent, 100.0, 100.0 + 1.1 * price) == "step_change"
