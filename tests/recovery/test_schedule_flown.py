"""What `verify` says, flown: hulls that are stable, hardly stable and unstable without a pilot, identified from pulses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from truth.hull import REMUS, Hull, with_fins, yaw_plane
from truth.pilots import Autopilot, excited
from truth.vehicle import QUIET, Fins, fly_vehicle

from fieldsid.errors import ModelError
from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import ParameterSource, source_of_models
from fieldsid.schedule.flown.response import overshoot, settling, swing
from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.make import design_schedule, usual_controller
from fieldsid.schedule.verify import STEPS_RAD, verify_schedule
from fieldsid.schedule.wish import Wish

FINS = Fins(lag=0.15, limit=0.35)
HULLS = {"stable": with_fins(REMUS, 3.0), "hardly stable": with_fins(REMUS, 2.0), "unstable": REMUS}
SPEEDS = (1.5, 2.0, 2.5)
TIMES, PULSES = (0.0, 4.0, 7.0, 10.0, 24.0, 27.0, 30.0, 40.0), (np.nan, 0.2, -0.2, np.nan, 0.1, -0.1, np.nan, np.nan)
LEAD_S = 20.0


@dataclass(frozen=True)
class Trial:
    hull: Hull
    runs: list[Run]
    source: ParameterSource


@pytest.fixture(scope="module")
def trial(request):
    hull = HULLS[request.param]
    flights = [
        fly_vehicle(
            excited(Autopilot(), "yaw", TIMES, PULSES),
            50.0,
            speed=u,
            hull=hull,
            fins=FINS,
            seed=i,
            run_up=Autopilot(),
            run_up_s=30.0,
        )
        for i, u in enumerate(SPEEDS)
    ]
    logs = [dict(f.log) for f in flights]
    runs = [Run(f"p{u}", log.pop("time_s"), log) for u, log in zip(SPEEDS, logs, strict=True)]
    (found,) = identify(runs, Axis.YAW, effects=("sway_coupling", "quadratic_damping"), joint=True, method="output_error")
    return Trial(hull, runs, source_of_models([found.model], ["pulses"]))


def flown(schedule, hull, speed, step):
    """Time after the step, heading and surge speed under the schedule's own law, without sensor noise."""
    level = Autopilot()

    def steer(t, seen):
        row = schedule.at(seen.surge)
        wanted = step if t >= LEAD_S else 0.0
        rudder = row.gains.kp * (wanted - seen.yaw) - row.gains.kd * seen.yaw_rate + row.feed_forward
        return float(np.clip(rudder, -row.fin_limit, row.fin_limit)), level(t, seen)[1]

    truth = fly_vehicle(
        steer, LEAD_S + 60.0, speed=speed, hull=hull, fins=FINS, sensors=QUIET, run_up=Autopilot(), run_up_s=30.0
    ).truth
    after = truth["time_s"] >= LEAD_S
    return truth["time_s"][after] - LEAD_S, truth["yaw_rad"][after][:, None], truth["surge_m_s"][after]


@pytest.mark.parametrize(
    "trial",
    ["hardly stable", *(pytest.param(hull, marks=pytest.mark.slow) for hull in ("stable", "unstable"))],
    indirect=True,
)
def test_steps_settle_as_said_and_nothing_hunts(trial):
    limits = FinLimits(lag=FINS.lag)
    assert usual_controller(trial.source) == "pd"
    surges = [float(r["surge_m_s"][:40].mean()) for r in trial.runs[::2]]
    schedule = design_schedule(trial.source, 0.26, speeds=surges, wish=Wish("pd"), limits=limits, runs=trial.runs)
    checked = {round(c.speed, 6): c for c in verify_schedule(schedule, trial.source, runs=trial.runs).scheduled}
    for speed, surge in zip(SPEEDS[::2], surges, strict=True):
        check = checked[round(surge, 6)]
        for step, said in list(zip(STEPS_RAD[Axis.YAW], check.steps, strict=True)):
            time, heading, kept = flown(schedule, trial.hull, speed, step)
            own = heading + step - heading[-100:].mean()
            took = settling(time, own, step)[0]
            print(f"{surge:.2f} m/s {np.degrees(step):3.0f} deg: said {said.settling:5.1f} s, flown {took:5.1f} s")
            assert swing(heading, step)[0] < 0.02
            assert overshoot(own, step)[0] < 0.2
            if step > 0.1:
                # how an unstable hull settles hangs on what its model leaves out: `verify` says so
                assert took == pytest.approx(said.settling, rel=0.35 if trial.hull is REMUS else 0.25, abs=0.5)
        assert check.speed_least == pytest.approx(kept.min(), rel=0.05)


@pytest.mark.parametrize("trial", ["hardly stable", pytest.param("unstable", marks=pytest.mark.slow)], indirect=True)
@pytest.mark.parametrize("with_runs", [False, True])
def test_what_p_cannot_hold_is_refused_with_what_can(trial, with_runs):
    growth = float(np.linalg.eigvals(yaw_plane(trial.hull, 2.0)[0]).real.max())
    assert growth > 0.0
    with pytest.raises(ModelError, match="unstable") as caught:
        design_schedule(
            trial.source, 0.26, speeds=[2.0], wish=Wish("p"), limits=FinLimits(lag=FINS.lag), runs=trial.runs if with_runs else ()
        )
    assert "`--controller pd`" in caught.value.hint
