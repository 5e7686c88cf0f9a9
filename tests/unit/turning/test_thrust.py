"""The thrust of a run over that of its start."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of
from fieldsid.turning.steady.speed_loss import thrust_ratio


@pytest.mark.parametrize(("column", "wanted"), [("thrust", 2.0), ("thrust_ratio", 2.0), ("propeller_rpm", 4.0)])
def test_the_thrust_goes_with_the_propellers_turns_squared(column, wanted):
    time = 0.1 * np.arange(400)
    signals = {"yaw_rate_rad_s": np.sin(time), "rudder_rad": 0.2 * np.cos(time), column: np.where(time < 20.0, 300.0, 600.0)}
    ratio = thrust_ratio(record_of(Run("a", time, signals), Axis.YAW))
    np.testing.assert_allclose(ratio[:150], 1.0)
    np.testing.assert_allclose(ratio[-150:], wanted)


@pytest.mark.parametrize("given", [{}, {"propeller_rpm": np.zeros(400)}])
def test_the_thrust_is_taken_as_even_where_none_is_logged_or_the_start_has_none(given):
    time = 0.1 * np.arange(400)
    signals = {"yaw_rate_rad_s": np.sin(time), "rudder_rad": 0.2 * np.cos(time), **given}
    np.testing.assert_array_equal(thrust_ratio(record_of(Run("a", time, signals), Axis.YAW)), 1.0)
