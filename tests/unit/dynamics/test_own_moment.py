"""A moment the core does not know, iterated along the trajectory, against the built-in effect that is the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth.paper import YAW, paper_run

from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.effect import effect_named
from fieldsid.models.record import record_of

BUILT_IN = effect_named("quadratic_damping")
OWN = replace(
    BUILT_IN,
    name="own_drag",
    core=None,
    initial_guesses=None,
    equivalent_solution=None,
    moment=lambda motion, values, _record: -values["quadratic"] * motion.rate * np.abs(motion.rate),
)


def problem(effect):
    log = paper_run(YAW[2])
    record = record_of(Run("paper", log.pop("time_s"), log), Axis.YAW)
    return Problem((record,), layout_of([record], Axis.YAW, (effect,)))


X = np.array([1.0, -1.0, -0.008, 2.0, 0.02, 0.01])


def test_the_iterated_moment_moves_the_vehicle_as_the_core_does():
    one, two = (problem(e).simulate(X, 0)[0] for e in (BUILT_IN, OWN))
    assert two.rate == pytest.approx(one.rate, abs=5e-4 * np.abs(one.rate).max())


def test_its_sensitivities_are_those_of_the_core():
    one, two = (problem(e).linearise(X, 0).sensitivity for e in (BUILT_IN, OWN))
    for mine, known in zip(two, one, strict=True):
        np.testing.assert_allclose(mine, known, atol=5e-3 * np.abs(known).max())
