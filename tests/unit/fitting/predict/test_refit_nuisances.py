"""The times and phases of a run are found where their scan's grid is coarser than the minimum."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.effects import all_effects
from fieldsid.fitting.predict.predict import refit_nuisances
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of

TIME, ANGLE, RATE = 0.05 * np.arange(1040), 0.004, 0.004
FIN = np.array([0.0, 0.2, 0.0, -0.2, 0.0, 0.2, 0.0])[np.searchsorted([3.0, 14.0, 18.0, 25.0, 29.0, 38.0], TIME)]
VALUES = {"a22": 1.2, "b2": -0.5, "C0": 0.0, "loss": 0.2, "moment_step": 0.0}


def problem_of(event):
    """The problem of a run whose fin loses a fifth of its authority at a share of it, and its true vector."""
    effect, still = all_effects(Axis.YAW)["step_change"], np.zeros(TIME.size)

    def logged(angle, rate):
        signals = {"yaw_rad": angle, "yaw_rate_rad_s": rate, "rudder_rad": FIN, "surge_m_s": still + 1.5}
        record = record_of(Run("run", TIME, signals), Axis.YAW)
        return Problem((record,), layout_of((record,), Axis.YAW, (effect,)))

    quiet = logged(still, still)
    x = np.array([VALUES.get(p.name, event if p.name == "event_time" else 0.0) for p in quiet.layout.parameters])
    motion, _ = quiet.simulate(x, 0)
    noise = np.random.default_rng(4).standard_normal((2, TIME.size))
    return logged(motion.angle + ANGLE * noise[0], motion.rate + RATE * noise[1]), x


@pytest.mark.parametrize("event", [0.47, 0.35, 0.6])
@pytest.mark.parametrize("start", [0.1, 0.5676, 0.9])
def test_an_event_beside_an_edge_of_the_fin_is_found_from_any_time(event, start):
    problem, truth = problem_of(event)
    place = [p.name for p in problem.layout.parameters].index("event_time")
    x = truth.copy()
    x[place] = start
    found = refit_nuisances(problem, x, 0, Noise(ANGLE, RATE))
    assert found[place] == pytest.approx(event, abs=0.01)
