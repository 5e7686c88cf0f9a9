"""A flight has as many steps for a ship as for an AUV: what is slow is flown longer, in longer steps, and said as it is."""

from __future__ import annotations

import numpy as np
import pytest
from truth.vehicle_kinds import KINDS, TRAINING, logs_of

from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.controller import closed_poles
from fieldsid.schedule.flown import response
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.plants import plants_of
from fieldsid.schedule.verdict import verdict_of
from fieldsid.schedule.verify import verify_schedule
from fieldsid.schedule.wish import Wish

KIND = {kind.name: kind for kind in KINDS}
LIMIT = 0.35


@pytest.fixture(scope="module")
def counted():
    """What verifying each kind of vehicle comes to, and how many steps of how many plants it took."""
    return {name: _verified(KIND[name]) for name in ("remus", "barge", "ship")}


def _verified(kind):
    runs, logs = [], logs_of(kind, "quadratic_damping")
    for name in TRAINING:
        columns = dict(logs[name])
        runs.append(Run(name, columns.pop("time_s"), columns))
    (fit,) = identify(runs, Axis.YAW, effects=("quadratic_damping",), joint=True, method="output_error")
    source, steps = source_of_models([fit.model], [kind.name]), []
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("FIELDSID_IS_WORKER", "1")  # what a forked worker counts is lost
        patched.setattr(response, "close_loop", _counting(response.close_loop, steps))
        schedule = design_schedule(source, LIMIT, wish=Wish("pd"))
        checked = verify_schedule(schedule, source)
    return schedule, checked, sum(steps), plants_of(source, schedule.stated_limits, (), None)


def _counting(loop, steps):
    def counted(*arguments):
        steps.append(arguments[-1].shape[0] * arguments[-1].shape[1])
        loop(*arguments)

    return counted


@pytest.mark.parametrize("name", ["barge", "ship"])
def test_a_slow_vehicle_is_flown_in_as_many_steps_as_a_quick_one(counted, name):
    assert counted[name][2] < 3.0 * counted["remus"][2]


@pytest.mark.parametrize("name", ["remus", "barge", "ship"])
def test_a_step_is_flown_until_it_has_settled_and_in_the_plants_own_time(counted, name):
    schedule, checked, _, plants = counted[name]
    assert verdict_of(checked, schedule, ())[0] == "holds"
    for check, row in zip([c for c in checked.scheduled if c.knot], schedule.rows, strict=True):
        poles = closed_poles(plants.family_at(row.speed, LIMIT, 1, 0), row.gains)[0]
        slowest = 1.0 / np.min(np.abs(poles.real))
        assert check.steps[1].flown > 5.0 * slowest
        assert 1.0 * slowest < check.settling < 5.0 * slowest
        assert row.settling == pytest.approx(check.settling_most, rel=0.1)


def test_the_same_vehicle_in_another_unit_of_time_gets_the_same_gains(counted):
    """Damping 1/T, authority 1/T^2: kp is a number, kd goes with T, and so does the time to settle."""
    (quick, one, *_), (slow, two, *_) = counted["remus"], counted["ship"]
    times = KIND["ship"].time_constant / KIND["remus"].time_constant
    assert slow.rows[0].gains.kp == pytest.approx(quick.rows[0].gains.kp, rel=0.05)
    assert slow.rows[0].gains.kd == pytest.approx(times * quick.rows[0].gains.kd, rel=0.15)
    assert two.scheduled[0].settling == pytest.approx(times * one.scheduled[0].settling, rel=0.1)
