"""Logs of good sensors in a sea: what the sea leaves of the error is many times the sensors' noise, and hides no effect."""

from __future__ import annotations

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

from fieldsid.diagnosis import diagnose
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis

CLOCK = Clock(0.1, 400)
HULL = Physics(damping=0.9, authority=-0.7, fin_bend=0.0)
SENSORS = {"angle_noise": 5e-4, "rate_noise": 5e-4}
SEA = {"gust": 3e-3, "gust_s": 3.0}


def logs(hidden):
    """Two runs to fit and one to judge by."""
    plans = (
        maneuvers.zigzag(CLOCK.time, 0.25, 0.4),
        maneuvers.multisine(CLOCK.time, np.random.default_rng(4), 0.25),
        maneuvers.zigzag(CLOCK.time, 0.15, 0.3),
    )
    runs = []
    for i, plan in enumerate(plans):
        log = flown(hidden, CLOCK, plan, seed=50 + i, **SENSORS, **SEA)
        signals = {k: log[k] for k in ("yaw_rad", "yaw_rate_rad_s", "rudder_rad", "surge_m_s")}
        runs.append(Run(f"run{i}", log["time_s"], signals))
    return runs[:2], runs[2:]


def test_a_plain_hull_in_a_sea_is_disturbed_and_nothing_is_missing():
    fitted, unseen = logs(HULL)
    found = diagnose(fitted, Axis.YAW, unseen)
    assert found.verdict == "disturbed"
    assert found.left.ratio > 4.0
    assert not found.left.unexplained


@pytest.mark.parametrize(
    ("hidden", "name"),
    [({"asymmetry": 0.3}, "asymmetric_fin"), ({"deadband_width": 0.12}, "deadband")],
    ids=["asymmetric", "deadband"],
)
def test_what_is_hidden_is_named_though_the_sea_leaves_many_times_the_noise(hidden, name):
    fitted, unseen = logs(HULL._replace(**hidden))
    found = diagnose(fitted, Axis.YAW, unseen)
    assert found.verdict == "effect"
    assert name in found.effects
    assert found.left.ratio > 4.0
