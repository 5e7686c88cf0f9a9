"""Logs of good sensors in a sea: what the sea leaves of the error is many times the sensors' noise, and hides no effect."""

from __future__ import annotations

import pytest
from three_flights import HULL, three_flights

from fieldsid.diagnosis import diagnose
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis

SENSORS = {"angle_noise": 5e-4, "rate_noise": 5e-4}
SEA = {"gust": 3e-3, "gust_s": 3.0}
SIGNALS = ("yaw_rad", "yaw_rate_rad_s", "rudder_rad", "surge_m_s")


def logs(hidden):
    """Two runs to fit and one to judge by."""
    flights = three_flights(hidden, seed=50, **SENSORS, **SEA)
    runs = [Run(f"run{i}", log["time_s"], {k: log[k] for k in SIGNALS}) for i, log in enumerate(flights)]
    return runs[:2], runs[2:]


def test_a_plain_hull_in_a_sea_is_disturbed_and_nothing_is_missing():
    fitted, unseen = logs(HULL)
    found = diagnose(fitted, Axis.YAW, unseen)
    assert found.verdict == "disturbed"
    assert found.left.ratio > 4.0
    assert not found.left.unexplained


@pytest.mark.parametrize(
    ("hidden", "name"),
    [
        pytest.param({"asymmetry": 0.3}, "asymmetric_fin", id="asymmetric"),
        pytest.param({"deadband_width": 0.12}, "deadband", id="deadband", marks=pytest.mark.slow),
    ],
)
def test_what_is_hidden_is_named_though_the_sea_leaves_many_times_the_noise(hidden, name):
    fitted, unseen = logs(HULL._replace(**hidden))
    found = diagnose(fitted, Axis.YAW, unseen)
    assert found.verdict == "effect"
    assert name in found.effects
    assert found.left.ratio > 4.0
