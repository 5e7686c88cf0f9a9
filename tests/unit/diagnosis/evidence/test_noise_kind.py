"""Sensors that wander are told from a sea that moves the hull, and neither is something missing."""

from __future__ import annotations

import numpy as np
import pytest
from truth.bank import make_case
from truth.logbook import flown
from truth.maneuvers import pulses
from truth.noise import Clock, ar1, white
from truth.paper import YAW, physics_of

from fieldsid.diagnosis import diagnose
from fieldsid.diagnosis.evidence.likelihood_fit import fit_maximum_likelihood, fit_output_error
from fieldsid.diagnosis.evidence.noise_kind import joint_noise_fit
from fieldsid.diagnosis.evidence.scored_model import score_model
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of
from fieldsid.noise.white_floor import WhiteBounds

CLOCK = Clock(0.05, 1200)
BESIDE = ParallelMap((), ())
PLAN = pulses(CLOCK.time, 0.26, 0.15, start=2.0, recovery=9.0)
WHITE, WANDER_S, GUST, GUST_S = 0.003, 2.0, 0.006, 1.5


def base(wander, gust, family):
    """The base model of three runs of one vehicle, judged under one kind of noise."""
    records = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        log = flown(physics_of(YAW[2]), CLOCK, PLAN, gust=gust, gust_s=GUST_S, seed=seed)
        for name in ("yaw_rad", "yaw_rate_rad_s"):
            count = log[name].size
            log[name] = log[name] + white(rng, count, WHITE) + ar1(rng, count, wander, WANDER_S, CLOCK.sample)
        records.append(record_of(Run(f"run{seed}", log.pop("time_s"), log), Axis.YAW))
    layout, floor = layout_of(tuple(records), Axis.YAW, ()), Noise(WHITE, WHITE)
    trial = fit_output_error(Problem(tuple(records), layout), equation_error_start(tuple(records), layout), floor)
    return score_model(fit_maximum_likelihood(trial.problem, trial.x, floor, WhiteBounds.near(floor), family), ())


@pytest.mark.parametrize("family", ["coloured", "disturbance"])
def test_both_are_found_where_both_are(family):
    noise = joint_noise_fit(base(0.01, GUST, family).likelihood_fit, BESIDE).noise
    assert noise.coloured_angle == pytest.approx(0.01, rel=0.3)
    assert noise.coloured_rate == pytest.approx(0.01, rel=0.3)
    assert noise.coloured_time == pytest.approx(WANDER_S, rel=0.5)
    assert noise.disturbance == pytest.approx(GUST, rel=0.4)


@pytest.mark.parametrize(
    ("wander", "gust", "family"), [(0.01, 0.0, "coloured"), (0.0, GUST, "disturbance"), (0.0, 0.0, "coloured")]
)
def test_a_noise_of_one_kind_is_left_as_it_is(wander, gust, family):
    h = base(wander, gust, family)
    assert joint_noise_fit(h.likelihood_fit, BESIDE) is h.likelihood_fit


@pytest.mark.slow
def test_nothing_is_missing_where_sensors_wander_in_a_sea():
    case = make_case(61, 155, kind="none")
    assert case.details["colour"] == "both"

    def runs(logs, what):
        return [Run(f"{what}{i}", log.pop("time_s"), log) for i, log in enumerate(logs)]

    found = diagnose(runs(case.training, "train"), Axis(case.axis), runs(case.validation, "check"))
    assert found.verdict in ("sufficient", "disturbed")
    assert found.effects == ()
    assert found.base.validation.over(found.noise_floor) < 2.0
