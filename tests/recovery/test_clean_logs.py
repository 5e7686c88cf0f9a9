"""Logs without noise, as a simulator writes them: what is hidden is named alone, and a model that follows is sufficient.

The measured speed of the runs is a little off, as any is: below the error that this makes nothing is missing.
"""

from __future__ import annotations

import numpy as np
import pytest
from three_flights import CLOCK, HULL, plans, three_flights
from truth.logbook import flown

from fieldsid.diagnosis import diagnose
from fieldsid.extension.extend import extend_in_steps, whole_of
from fieldsid.fitting.fit import fit
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

SPEEDS = (1.5, 1.503, 1.498)
"""What the logs say of runs that were all flown at one speed."""


def logs(hidden):
    """Two runs to fit and one to judge by, exact but for the measured speed."""
    runs = []
    for i, (log, speed) in enumerate(zip(three_flights(hidden), SPEEDS, strict=True)):
        signals = {k: log[k] for k in ("yaw_rad", "yaw_rate_rad_s", "rudder_rad")}
        runs.append(Run(f"run{i}", log["time_s"], signals | {"surge_m_s": np.full(CLOCK.time.size, speed)}))
    return runs[:2], runs[2:]


def test_nothing_is_missing_where_the_model_follows_as_well_as_the_speed_was_measured():
    fitted, unseen = logs(HULL)
    found = diagnose(fitted, Axis.YAW, unseen)
    assert found.verdict == "sufficient"
    assert found.left.ratio < 1.0


@pytest.mark.parametrize(
    ("hidden", "name"),
    [
        pytest.param({"servo_tau": 0.4}, "servo_lag", id="lag"),
        pytest.param({"quadratic": 1.0}, "quadratic_damping", id="quadratic", marks=pytest.mark.slow),
    ],
)
def test_what_is_hidden_is_named_alone_and_added_with_the_error_that_was_named(hidden, name):
    fitted, unseen = logs(HULL._replace(**hidden))
    found = diagnose(fitted, Axis.YAW, unseen)
    assert found.verdict == "effect"
    assert found.effects == (name,)
    assert found.left.ratio < 1.0 < found.base.validation.over(found.noise_floor)
    plain = fit([record_of(run, Axis.YAW) for run in fitted], Axis.YAW).model
    added = whole_of(extend_in_steps(plain, found.effects, fitted, unseen))
    assert added.pays
    assert added.gain.noise_floor == found.noise_floor
    assert max(added.gain.left(kept=True)) < 1.0


def test_a_filter_of_the_rate_and_a_moment_in_no_catalogue_hide_nothing_that_the_hull_has():
    """As in a towing tank: the rate was smoothed, so that it is not quite the slope of the heading, and no model is exact."""
    runs = []
    for i, log in enumerate(three_flights(HULL._replace(servo_tau=0.4, quadratic=2.0, memory_moment=0.05))):
        ends = np.pad(log["yaw_rate_rad_s"], 1, mode="edge")
        smooth = {"yaw_rate_rad_s": 0.25 * ends[:-2] + 0.5 * ends[1:-1] + 0.25 * ends[2:]}
        signals = {k: log[k] for k in ("yaw_rad", "rudder_rad")} | smooth | {"surge_m_s": np.full(CLOCK.time.size, 1.5)}
        runs.append(Run(f"run{i}", log["time_s"], signals))
    found = diagnose(runs[:2], Axis.YAW, runs[2:])
    assert found.noiseless
    assert {"servo_lag", "quadratic_damping"} <= set(found.effects) <= {"servo_lag", "quadratic_damping", "sway_coupling"}
    assert found.final.validation.mean < 0.05 * found.base.validation.mean


@pytest.mark.parametrize(
    ("hidden", "name"),
    [
        pytest.param({"max_rate": 0.3}, "rate_limit", id="rate", marks=pytest.mark.slow),
        pytest.param({"stall_angle": 0.12, "stall_slope": 0.5}, "stall", id="stall"),
    ],
)
def test_the_trim_may_be_a_moment_of_its_own_beside_the_effect_that_is_named(hidden, name):
    """The plain model, which lacks the effect, prefers a trim that grows with the authority."""
    runs = []
    for i, (plan, speed) in enumerate(zip(plans(), (1.1, 1.6, 1.1), strict=True)):
        by_speed = {"damping": 0.9 * speed / 1.5, "authority": -0.7 * (speed / 1.5) ** 2}
        log = flown(HULL._replace(**by_speed, **hidden, trim=0.002), CLOCK, plan, seed=i)
        signals = {k: log[k] for k in ("yaw_rad", "yaw_rate_rad_s", "rudder_rad")}
        runs.append(Run(f"run{i}", log["time_s"], signals | {"surge_m_s": np.full(CLOCK.time.size, speed)}))
    found = diagnose(runs[:2], Axis.YAW, runs[2:])
    assert found.effects == (name,)
    assert found.left.ratio < 0.1
