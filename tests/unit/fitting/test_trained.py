"""What a model keeps of the runs it is from: how their thrust went with the speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth.paper import YAW, paper_run

from fieldsid.fitting.fit import trained
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of


def kept(speeds, thrusts):
    records = []
    for i, (speed, thrust) in enumerate(zip(speeds, thrusts, strict=True)):
        log = paper_run(YAW[2], angle_noise=0.005, rate_noise=0.005, seed=i + 1)
        record = record_of(Run(f"run{i}", log.pop("time_s"), log), Axis.YAW)
        signals = dict(record.signals) | {"thrust": np.full(len(record), thrust)}
        records.append(replace(record, speed=speed, signals=signals))
    return trained(Problem(tuple(records), layout_of(records, Axis.YAW, ())))


def thrust_at(known, speed):
    return known["thrust_at_1_m_s"] * speed ** known["thrust_exponent"]


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_the_thrust_goes_with_the_speed_as_from_run_to_run(exponent):
    known = kept((1.0, 1.4, 2.0), [5.0 * s**exponent for s in (1.0, 1.4, 2.0)])
    assert known["thrust_exponent"] == pytest.approx(exponent)
    assert [thrust_at(known, s) for s in (1.0, 1.7)] == pytest.approx([5.0, 5.0 * 1.7**exponent])


def test_runs_at_one_speed_leave_it_to_the_drag():
    known = kept((1.5, 1.5), (5.0, 5.2))
    assert known["thrust_exponent"] == 2.0
    assert thrust_at(known, 1.5) == pytest.approx(5.1)


@pytest.mark.parametrize("thrust", [1.0, 5.0], ids=["whose logarithm is zero", "of any other size"])
def test_a_thrust_that_stays_is_kept_as_it_is(thrust):
    known = kept((1.0, 2.0), (thrust, thrust))
    assert known["thrust_exponent"] == pytest.approx(0.0, abs=1e-12)
    assert known["thrust_at_1_m_s"] == pytest.approx(thrust)
