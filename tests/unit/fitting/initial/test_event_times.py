"""The times of an event: where they are searched for, and that no descent ends at a wrong one that another leads away from."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fieldsid.dynamics.free_run import command_record, simulate
from fieldsid.effects import pick_effect
from fieldsid.estimators.output_error import found_minimum, minimise
from fieldsid.fitting.initial.event_times import event_times
from fieldsid.fitting.initial.other_event_times import starts_at_other_times
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of, levenberg_marquardt
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import SpeedLaw

NOISE = Noise(0.004, 0.004)
TIME = np.arange(0.0, 40.0, 0.05)
EDGES = (4.0, 8.0, 9.0, 10.5, 12.0, 17.0, 19.0, 21.5, 23.0, 24.0)
EVENTS = (0.24, 0.54)
LOSS = 0.15


def pulses(sign=1.0):
    """A fin that swings to alternate sides between its edges, with a rest after the fifth, and rests after the last."""
    fin = np.zeros(TIME.size)
    for i, (begin, end) in enumerate(pairwise(EDGES)):
        if i != 4:
            fin[(begin <= TIME) & (end > TIME)] = 0.2 * (-1.0) ** i
    return sign * fin


def logged(seed, event):
    """A run in which the fin loses some of its authority."""
    rng = np.random.default_rng(seed)
    values = {"a22": 1.1, "b2": -0.6, "C0": 0.003, "loss": LOSS, "moment_step": 0.0}
    model = Model(Axis.YAW, ("step_change",), values, {}, (), np.zeros((0, 0)), SpeedLaw(1.2), NOISE)
    record = command_record(Axis.YAW, TIME, pulses((-1.0) ** seed), speed=1.2, name=f"run{seed}")
    motion = simulate(model, record, state=(0.1, 0.0, 0.0), nuisance={"event_time": event})
    angle, rate = (v + NOISE.angle * rng.standard_normal(TIME.size) for v in (motion.angle, motion.rate))
    ok = np.ones(TIME.size, bool)
    return replace(record, angle=angle, rate=rate, angle_ok=ok, rate_ok=ok)


@pytest.fixture(scope="module")
def problem():
    """Two runs with an event each."""
    records = tuple(logged(seed, event) for seed, event in enumerate(EVENTS))
    return Problem(records, layout_of(records, Axis.YAW, (pick_effect("step_change"),)))


def places(problem):
    return [i for i, s in enumerate(problem.layout.parameters) if s.is_event]


def at_times(problem, x, times):
    """The minimum with the events held at some times."""
    x = x.copy()
    x[places(problem)] = times
    free = [i for i in range(x.size) if i not in places(problem)]
    return levenberg_marquardt(problem, x, NOISE, free=free).x


def test_half_of_the_times_are_where_the_fin_acts_whatever_its_side():
    record = command_record(Axis.YAW, TIME, pulses(), speed=1.2, name="run")
    times = event_times(record)
    assert (times[0], times[-1]) == (0.0, 1.0)
    assert (np.diff(times) > 0.0).all()
    deflected = np.abs(np.interp(times, np.linspace(0.0, 1.0, TIME.size), record.fin)) > 0.0
    share = float(np.mean(record.fin != 0.0))
    # half by its action, and of the half by time its share
    assert np.mean(deflected) == pytest.approx(0.5 + 0.5 * share, abs=0.05)
    np.testing.assert_array_equal(times, event_times(replace(record, fin=-record.fin)))


def test_the_times_are_equally_far_apart_where_the_fin_rests_throughout_or_only_a_part_is_searched():
    record = command_record(Axis.YAW, TIME, np.zeros(TIME.size), speed=1.2, name="run")
    np.testing.assert_allclose(event_times(record, 5), [0.0, 0.25, 0.5, 0.75, 1.0])
    np.testing.assert_allclose(event_times(record, 3, 0.2, 0.4), [0.2, 0.3, 0.4])


def test_no_start_is_said_twice_while_the_fin_rests_and_only_what_is_free_moves(problem):
    """After its last edge the fin rests: all times there are one."""
    x = at_times(problem, found_minimum(problem)[0].x, (0.8, 0.54))
    own = problem.layout.nuisances_of(0)
    starts = starts_at_other_times(problem, x, NOISE, 100, own)
    held = [i for i in range(x.size) if i not in own]
    assert all((s[held] == x[held]).all() for s in starts)
    late = [s for s in starts if s[places(problem)[0]] > 24.5 / TIME[-1]]
    assert len(late) <= 1
    assert len(starts) == len({tuple(s) for s in starts}) > 2


@pytest.mark.parametrize(
    "wrong", [(0.24, 0.3), *(pytest.param(at, marks=pytest.mark.slow) for at in ((0.24, 0.595), (0.5, 0.54)))]
)
def test_another_minimum_of_the_cost_leads_to_the_true_one(problem, wrong):
    x = at_times(problem, found_minimum(problem)[0].x, wrong)
    starts = starts_at_other_times(problem, x, NOISE, 6)
    costs = [cost_of(problem, levenberg_marquardt(problem, s, NOISE).x, NOISE) for s in starts]
    best = cost_of(problem, at_times(problem, x, EVENTS), NOISE)
    assert min(costs) < best + 1.0
    assert best + 10.0 < cost_of(problem, x, NOISE)


def test_the_minimum_found_is_at_the_true_times(problem):
    found, _ = found_minimum(problem)
    assert found.x[places(problem)] == pytest.approx(EVENTS, abs=0.01)
    assert dict(zip(problem.layout.names, found.x, strict=False))["loss"] == pytest.approx(LOSS, rel=0.1)


def test_a_descent_goes_along_an_edge_of_the_fin(problem):
    """Over an edge the cost has a kink in the event's time: a step of all parameters is refused, one of the others is not."""
    truth, _ = found_minimum(problem)
    for offset in np.linspace(-0.02, 0.02, 9):
        x = truth.x.copy()
        x[places(problem)] = np.array([21.5, 10.5]) / TIME[-1] + offset
        x[:4] *= 1.02
        end = levenberg_marquardt(problem, x, NOISE, max_iterations=200)
        free = [i for i in range(x.size) if i not in places(problem)]
        along = levenberg_marquardt(problem, end.x, NOISE, free=free)
        assert end.cost < along.cost + 0.01


def test_the_order_of_the_runs_does_not_matter(problem):
    other = replace(problem, records=problem.records[::-1])
    one, _ = minimise(problem, found_minimum(problem)[0].x, NOISE)
    two, _ = found_minimum(other)
    np.testing.assert_allclose(two.x[places(other)], one.x[places(problem)][::-1], atol=1e-4)
