"""The fit of surge, sway and yaw to all runs: the noise that it ends at is the sensors'."""

from __future__ import annotations

import numpy as np
import pytest
from truth.maneuvering.hulls import draw_hull
from truth.maneuvering.motion import true_turn
from truth.maneuvering.trials import GYRO, training

from fieldsid.logs.run import Run
from fieldsid.turning.maneuvering.equations import coefficients, settle
from fieldsid.turning.maneuvering.fit import fit_maneuvering
from fieldsid.turning.maneuvering.flown import RATE, usable_runs


def test_the_noise_of_an_unstable_hull_is_not_taken_before_its_segments_follow():
    """Begun again from the first states measured, its rate was left with a noise of 0.38 rad/s and its radius was 17 % off."""
    hull = draw_hull(41, 47)
    logs = training(hull, "pulses+circle", np.random.default_rng([47, 41, 2]), sway=False)
    fitted = fit_maneuvering(usable_runs([Run(log.name, log.time, log.columns) for log in logs], ()), None)
    assert fitted.noise[RATE] < 2.0 * GYRO
    for speed in (hull.speeds[0], hull.speeds[4]):
        surge, sway, rate = settle(coefficients(fitted.vector), speed, -hull.rudder_limit)
        assert np.hypot(surge, sway) / rate == pytest.approx(true_turn(hull, speed, 1.0)[0], rel=0.05)
