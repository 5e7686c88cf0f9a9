"""The schedule flown on the six-degree-of-freedom vehicle with fin lag, limits and noise, against one constant gain."""

from __future__ import annotations

import numpy as np
from truth.pilots import Autopilot, excited
from truth.vehicle import Fins, fly_vehicle

from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model
from fieldsid.plant.parameter_source import load_parameter_source
from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.verify import checked_speeds, verify_schedule
from fieldsid.schedule.wish import Wish

KNOTS = (1.2, 1.6, 2.0)
FINS = Fins(lag=0.15, rate=1.0, limit=0.3)
BENT = np.deg2rad(3.0)
STEP = np.deg2rad(20.0)
TIMES, PULSES = (0.0, 5.0, 7.0, 9.0, 20.0, 22.0, 24.0), (np.nan, 0.26, -0.26, np.nan, 0.15, -0.15, np.nan)


def flown(speed: float, seed: int, fins: Fins = FINS) -> Run:
    log = dict(fly_vehicle(excited(Autopilot(), "yaw", TIMES, PULSES), 36.0, speed=speed, fins=fins, seed=seed).log)
    return Run(f"pulses_{speed:.1f}", log.pop("time_s"), log)


def schedule_from(folder, fins: Fins, bandwidth: float | None = 0.97):
    paths = []
    for i, speed in enumerate(KNOTS):
        (fit,) = identify([flown(speed, 20 + i, fins)], Axis.YAW, method="output_error")
        paths.append(save_model(fit.model, folder / f"m{i}.yaml"))
    limits = FinLimits(lag=fins.lag, rate=fins.rate)
    source = load_parameter_source(paths)
    return design_schedule(source, fins.limit, wish=Wish("pd", bandwidth=bandwidth), limits=limits), source


def steered(row, speed: float, *, fins: Fins = FINS, step: float = STEP, forward: bool = True, seed: int = 50):
    """Heading (n,) without noise while the schedule's own law steers the vehicle to `step`."""
    level = Autopilot(heading=None)
    gains = row.gains

    def pilot(t, seen):
        wanted = step if t >= 2.0 else 0.0
        rudder = gains.kp * (wanted - seen.yaw) - gains.kd * seen.yaw_rate + (row.feed_forward if forward else 0.0)
        return (float(np.clip(rudder, -row.fin_limit, row.fin_limit)), level(t, seen)[1])

    truth = fly_vehicle(pilot, 45.0, speed=speed, fins=fins, seed=seed).truth
    return truth["time_s"] - 2.0, truth["yaw_rad"]


def figures(time, yaw):
    """Overshoot in percent and settling time (10 % corridor) of a step."""
    over = 100.0 * max(float(np.max(yaw)) / STEP - 1.0, 0.0)
    off = np.flatnonzero(np.abs(yaw - STEP) > 0.1 * STEP)
    return over, float(time[off[-1]])


def test_steps_are_damped_and_quick_at_every_speed_and_none_slower_than_the_constant_gain(tmp_path):
    schedule, source = schedule_from(tmp_path, FINS, bandwidth=None)
    constant = verify_schedule(schedule, source).constant_row
    rows = []
    for speed, knot in checked_speeds(schedule):
        ours = figures(*steered(schedule.at(speed), speed))
        theirs = figures(*steered(constant, speed))
        rows.append((speed, knot, *ours, *theirs))
        words = f"schedule {ours[0]:5.1f} % {ours[1]:5.1f} s   constant {theirs[0]:5.1f} % {theirs[1]:5.1f} s"
        print(f"{speed:.2f} m/s {'knot' if knot else '    '} {words}")
    assert max(r[2] for r in rows) < 25.0
    assert max(r[3] for r in rows) < 15.0
    assert max(r[3] for r in rows) <= max(r[5] for r in rows) + 0.5


def test_the_steady_error_of_a_bent_fin_goes_to_zero_by_the_feed_forward(tmp_path):
    bent = Fins(lag=FINS.lag, rate=FINS.rate, limit=FINS.limit, rudder_offset=BENT)
    row = schedule_from(tmp_path, bent)[0].at(1.5)
    tail = [float(np.mean(steered(row, 1.5, fins=bent, step=0.0, forward=f)[1][-200:])) for f in (True, False)]
    assert abs(row.feed_forward + BENT) < np.deg2rad(0.5)
    assert abs(tail[0]) < np.deg2rad(1.0)
    assert abs(tail[1]) > 5.0 * abs(tail[0])
