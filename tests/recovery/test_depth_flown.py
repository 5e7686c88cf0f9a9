"""The pitch cascade, flown: REMUS identified in pitch from pulses, a step of depth under the schedule's own law."""

from __future__ import annotations

import numpy as np
import pytest
from truth.hull import REMUS, with_fins
from truth.pilots import Autopilot, excited
from truth.vehicle import QUIET, Fins, fly_vehicle

from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.verify import DEPTH_STEP_M, PITCH_LIMIT_RAD, verify_schedule
from fieldsid.schedule.wish import Wish

HULL, FINS, SPEED, START_M = with_fins(REMUS, 3.0), Fins(lag=0.15, limit=0.35, elevator_offset=0.02), 1.5, 5.0
TIMES, PULSES = (0.0, 4.0, 6.0, 8.0, 20.0, 22.0, 24.0, 36.0), (np.nan, 0.15, -0.15, np.nan, -0.1, 0.1, np.nan, np.nan)


@pytest.fixture(scope="module")
def schedule():
    """Gains of pitch with the depth loop, and what verify says of them."""
    log = dict(
        fly_vehicle(
            excited(Autopilot(), "pitch", TIMES, PULSES), 50.0, speed=SPEED, hull=HULL, fins=FINS, seed=3, run_up=Autopilot(),
            run_up_s=30.0,
        ).log
    )  # fmt: skip
    run = Run("pitch", log.pop("time_s"), log)
    (found,) = identify([run], Axis.PITCH, effects=("heave_coupling",), method="output_error")
    source = source_of_models([found.model], ["pitch"])
    wish = Wish("pd", step=float(np.radians(10.0)))
    made = design_schedule(source, 0.26, wish=wish, limits=FinLimits(lag=FINS.lag), depth=True)
    (check,) = verify_schedule(made, source, draws=20).scheduled
    return made, check


def flown(row, wanted, seconds):
    """Time, depth and pitch under the row's law, depth `wanted` from the start on."""
    level = Autopilot()

    def steer(t, seen):
        pitch = float(np.clip(row.depth_gain * (seen.depth - wanted), -PITCH_LIMIT_RAD, PITCH_LIMIT_RAD))
        plane = (
            row.gains.kp * (pitch - seen.pitch) - row.gains.kd * seen.pitch_rate + row.feed_forward + row.reference_gain * pitch
        )
        return level(t, seen)[0], float(np.clip(plane, -row.fin_limit, row.fin_limit))

    truth = fly_vehicle(steer, seconds, speed=SPEED, hull=HULL, fins=FINS, sensors=QUIET, run_up=Autopilot(), run_up_s=30.0).truth
    return truth["time_s"], truth["depth_m"], truth["pitch_rad"]


def test_a_step_of_depth_comes_to_rest_where_it_was_asked_and_not_much_later_than_said(schedule):
    made, check = schedule
    time, depth, pitch = flown(made.rows[0], START_M + DEPTH_STEP_M, 90.0)
    rest = float(depth[-100:].mean())
    off = np.flatnonzero(np.abs(depth - rest) > 0.05 * DEPTH_STEP_M)
    took = float(time[off[-1]])
    print(f"kz {made.rows[0].depth_gain:.3f}: said {check.depth_settling:.1f} s, flown {took:.1f} s, rests {rest:.2f} m")
    assert np.isfinite(check.depth_settling)
    # the model knows pitch, not the path: heave makes the path follow it later (8.3 s flown, 5.5 s said)
    assert check.depth_settling - 1.0 < took < 1.8 * check.depth_settling
    assert np.ptp(depth[-400:]) < 0.05
    assert rest == pytest.approx(START_M + DEPTH_STEP_M, abs=0.35)
    assert np.abs(pitch).max() < PITCH_LIMIT_RAD + 0.1
    assert (depth.max() - START_M) / DEPTH_STEP_M < 1.3
