"""Gains are continuous in the speed: neighbouring rows differ by what the plant differs, and keep what was asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.linear_plant import FinLimits, plants_at
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.search.formulas import bandwidth_of, fin_bandwidth, formula_of
from fieldsid.schedule.search.objective import smooth_settling
from fieldsid.schedule.search.optimum import minimum
from fieldsid.schedule.wish import Wish

REFERENCE = 1.5
HULLS = {
    "quick fin": {"a22": 0.9, "b2": -0.8, "lag": 0.1},
    "slow fin": {"a22": 0.5, "b2": -1.4, "lag": 0.5},
    "unstable": {"a22": -0.15, "b2": -0.5, "lag": 0.2},
}


def source_at(values):
    own = values | {"C0": 0.01, "quadratic": 0.8}
    covariance = np.diag([(0.04 * v) ** 2 for v in own.values()])
    trained = {"speed_low": 1.0, "speed_high": 2.0, "fin_max": 0.26, "rate_max": 0.3}
    effects = ("servo_lag", "quadratic_damping")
    law = SpeedLaw(REFERENCE)
    return source_of_models([Model(Axis.YAW, effects, own, {}, tuple(own), covariance, law, Noise(0.005, 0.005), trained)], ["m"])


@pytest.mark.parametrize("hull", [pytest.param(h, marks=() if h == "quick fin" else pytest.mark.slow) for h in HULLS])
def test_no_step_of_the_gains_is_larger_than_the_plants_own(hull):
    speeds = np.geomspace(1.2, 1.2 * 1.02**6, 7)
    rows = design_schedule(source_at(HULLS[hull]), 0.26, speeds=list(speeds), wish=Wish("pd")).rows
    kp, kd = (np.array([getattr(r.gains, n) for r in rows]) for n in ("kp", "kd"))
    # from row to row the speed rises by 2 %, the fin's authority by 4 %; kd b = 2 zeta w - a differs by no more of its own terms
    authority = abs(HULLS[hull]["b2"]) * (speeds / REFERENCE) ** 2
    damped = abs(kd) + abs(HULLS[hull]["a22"]) / authority * speeds / REFERENCE
    # the slowest row asks for the whole fin, of which its trim takes a little on one side
    assert np.abs(np.diff(np.log(np.abs(kp)))).max() < 0.045
    assert (np.abs(np.diff(kd)) / damped[1:]).max() < 0.06
    assert all(r.draws_held >= 0.95 for r in rows)
    assert all(r.phase_margin_deg >= 22.5 - 0.1 for r in rows)


def test_the_minimum_is_found_inside_and_at_an_end():
    assert minimum(lambda x: (x - 0.37) ** 2, -1.0, 2.0) == pytest.approx(0.37, abs=2e-3)
    assert minimum(lambda x: -x, -1.0, 2.0) == 2.0
    assert minimum(lambda x: abs(x - 1.1) + 0.1 * x, -1.0, 2.0) == pytest.approx(1.1, abs=5e-3)


@pytest.mark.parametrize("stiffness", [-0.3, 0.0, 0.4, 5.0])
def test_a_share_of_one_asks_for_the_fin_allowed_and_no_more(stiffness):
    one = replace(plants_at(source_at(HULLS["quick fin"]), REFERENCE, FinLimits(), 1, 0)[0][0], stiffness=np.array([stiffness]))
    gains = formula_of(one, Wish("pd", step=0.2), 0.26)(1.0, 1.0)
    assert abs(gains.kp) * 0.2 == pytest.approx(0.26)
    assert bandwidth_of(one, gains) == pytest.approx(fin_bandwidth(one, 0.26, 0.2))


@pytest.mark.parametrize("stiffness", [-0.3, 0.0, 0.4, 5.0])
def test_lqr_has_the_gains_of_the_riccati_equation(stiffness):
    one = replace(plants_at(source_at(HULLS["unstable"]), REFERENCE, FinLimits(), 1, 0)[0][0], stiffness=np.array([stiffness]))
    gains = formula_of(one, Wish("lqr", step=0.2), 0.26)(0.7, 1.0)
    a, b = float(one.slow_damping[0]), float(one.slow_authority[0])
    system, drive = np.array([[0.0, 1.0], [-stiffness, -a]]), np.array([[0.0], [b]])
    cost = np.array([[0.26**-2]])
    solved = solve_continuous_are(system, drive, np.diag([(0.7**2 / 0.2) ** 2, 0.0]), cost)
    assert np.allclose([gains.kp, gains.kd], (drive.T @ solved)[0] / cost[0, 0], rtol=1e-6)


def test_of_steps_that_are_not_there_in_the_end_the_one_further_off_is_later():
    time = np.linspace(0.0, 20.0, 1001)
    steps = np.column_stack([1.0 - np.exp(-time / t) for t in (2.0, 8.0, 20.0, 80.0, 1e6)])
    settled = smooth_settling(time, steps, 1.0)
    assert settled[0] == pytest.approx(2.0 * np.log(20.0), rel=0.01)
    assert np.all(np.diff(settled) > 0.0)
    assert np.all(settled[1:] > 20.0)
