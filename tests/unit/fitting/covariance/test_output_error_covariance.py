"""Moments of the runs' own in the covariance of an output-error fit: what they move is the trim, by their mean."""

from __future__ import annotations

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.paper import DEG, YAW, physics_of

from fieldsid.fitting.covariance.output_error_covariance import coloured_covariance
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.optimise.levenberg_marquardt import levenberg_marquardt
from fieldsid.fitting.optimise.residual_weights import white_weights
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of

CLOCK = Clock(0.05, 660)


@pytest.mark.parametrize("count", [1, 3])
def test_moments_of_the_runs_own_add_the_variance_of_their_mean_to_the_trim_alone(count):
    plan = maneuvers.pulses(CLOCK.time, 0.26, 0.15, start=2.0, recovery=9.0)
    log = dict(flown(physics_of(YAW[1]), CLOCK, plan, angle_noise=0.3 * DEG, rate_noise=0.3 * DEG, seed=3))
    time = log.pop("time_s")
    records = tuple(record_of(Run(f"pulses_{i}", time, log), Axis.YAW) for i in range(count))
    layout = layout_of(records, Axis.YAW, ())
    problem = Problem(records, layout)
    found = levenberg_marquardt(problem, equation_error_start(records, layout), Noise(0.005, 0.005))
    weights = white_weights(problem, found.x)

    def variances(own_moment):
        full = coloured_covariance(problem, found, weights, Noise(weights.angle, weights.rate, own_moment=own_moment))
        return np.diag(full)[:3]

    added = variances(0.02) - variances(0.0)
    sigma = np.sqrt(added.clip(0.0)) / np.abs(found.x[:3])
    assert layout.names[:3] == ("a22", "b2", "C0")
    assert added[2] == pytest.approx(0.02**2 / count, rel=1e-3)
    assert max(sigma[:2]) < 1e-3
