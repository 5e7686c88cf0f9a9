"""What the covariance of an estimate says of a parameter on a bound."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.dynamics.free_run import command_record
from fieldsid.effects import pick_effect
from fieldsid.fitting.problem.estimator import shared_covariance
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import Axis

TIME = np.arange(100) * 0.05


@pytest.mark.parametrize(
    ("share", "variance", "kept"),
    [("low", 1e60, False), ("low", 1e-4, True), ("middle", 1e60, True)],
    ids=["on a bound, no information", "on a bound, measured", "between the bounds"],
)
def test_a_parameter_on_a_bound_of_which_the_runs_say_nothing_has_no_variance(share, variance, kept):
    record = command_record(Axis.YAW, TIME, np.zeros(100), speed=1.5, name="run")
    problem = Problem((record,), layout_of([record], Axis.YAW, (pick_effect("servo_lag"),)))
    layout = problem.layout
    slot = layout.names.index("lag")
    lag = layout.parameters[slot]
    x = np.array([p.start for p in layout.parameters])
    x[slot] = lag.low if share == "low" else 0.5 * (lag.low + lag.high)
    full = np.full((len(x), len(x)), 1e-6) + np.eye(len(x))
    full[slot, slot] = variance
    found = shared_covariance(problem, x, full, tuple(range(len(x))))
    assert bool(found[slot, slot] == variance) is kept
    assert bool((found[slot] != 0.0).any()) is kept
    others = [i for i in range(layout.shared) if i != slot]
    assert found[np.ix_(others, others)] == pytest.approx(full[np.ix_(others, others)])
