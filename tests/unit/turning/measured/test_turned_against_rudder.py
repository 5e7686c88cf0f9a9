"""A circle turned away from its rudder, as an unstable hull may turn: said, and not compared with the rudder's circle."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.turning.radius import turn_radius

VALUES = {"a22": 1.0, "b2": -1.0, "C0": 0.0}
RATE, SPEED = 0.3, 1.5


def circle(rudder):
    """To starboard, after ten seconds of a straight run."""
    time = np.arange(0.0, 70.0, 0.1)
    rate = np.where(time < 10.0, 0.0, RATE)
    yaw = np.cumsum(rate) * 0.1
    x, y = np.cumsum(SPEED * np.cos(yaw)) * 0.1, np.cumsum(SPEED * np.sin(yaw)) * 0.1
    columns = {"yaw_rad": yaw, "yaw_rate_rad_s": rate, "x_m": x, "y_m": y, "surge_m_s": np.full(time.size, SPEED)}
    return Run("circle", time, columns | {"rudder_rad": np.where(time < 10.0, 0.0, rudder)})


@pytest.mark.parametrize(("rudder", "against"), [(-0.3, False), (0.3, True)])
def test_it_is_said_and_not_compared(rudder, against):
    model = Model(Axis.YAW, (), VALUES, {}, tuple(VALUES), np.eye(3) * 1e-4, SpeedLaw(SPEED), Noise(0.005, 0.005))
    found = turn_radius(source_of_models([model], ["m"]), [SPEED], 0.3, measured=[circle(rudder)])
    assert ("turned_against_rudder" in [n.code for n in found.notes]) == against
    assert (not found.measured) == against
    assert ("measured" in {r.trust for r in found.rows}) != against
