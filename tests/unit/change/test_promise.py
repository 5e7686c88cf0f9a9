"""As promised? A vehicle that is the model's flies as its verification says; one of less damping and a slow servo does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cli import trial

from fieldsid.change.promise import FlownStep, kept_steps
from fieldsid.errors import DataError
from fieldsid.logs import save_run
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model
from fieldsid.plant.parameter_source import load_parameter_source, source_of_models
from fieldsid.schedule.flown.response import Flight, fly
from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.plants import models_plants
from fieldsid.schedule.wish import Wish

SPEED, LIMIT, STEP, LEAD, RATE = 1.4, 0.35, 0.35, 5.0, 20.0


def source_of(model):
    return source_of_models([model], ["hull"])


@pytest.fixture(scope="module")
def schedule():
    return design_schedule(source_of(trial.vehicle(Axis.YAW)), LIMIT, speeds=[SPEED])


def flown(schedule, model, *, limits=FinLimits(), size=STEP):  # noqa: B008 - a frozen record
    """Fly one step of the heading with a schedule and another vehicle, as its sensors see it."""
    plant = models_plants(source_of(model), limits, ()).family_at(SPEED, LIMIT, 1, 0)
    answer = fly(plant, schedule.rows, Flight(30.0, reference=abs(size)))
    time = np.arange(0.0, LEAD + 30.0, 1.0 / RATE)
    noise = np.random.default_rng(4).normal(0.0, 0.005, time.size)
    moved = np.interp(time - LEAD, answer.time, answer.angle[:, 0], left=0.0)
    goal, surge = 0.8 + size * (time >= LEAD), SPEED + 0.0 * time
    signals = {"yaw_rad": 0.8 + np.sign(size) * moved + noise, "yaw_goal_rad": goal, "surge_m_s": surge}
    return Run("sea", time, signals)


@pytest.mark.parametrize("size", [STEP, -STEP])
def test_the_models_own_vehicle_flies_as_promised(schedule, size):
    plants = models_plants(source_of(trial.vehicle(Axis.YAW)), FinLimits(), ())
    (step,) = kept_steps(schedule, plants, flown(schedule, trial.vehicle(Axis.YAW), size=size))
    assert step.broken == ()
    assert step.start == pytest.approx(LEAD)
    assert step.size == pytest.approx(size, abs=0.01)
    assert step.flown.settling == pytest.approx(step.promised.settling, abs=0.6)
    assert step.flown.overshoot == pytest.approx(step.promised.overshoot, abs=0.04)


def test_a_slow_servo_breaks_what_was_promised(schedule):
    plants = models_plants(source_of(trial.vehicle(Axis.YAW)), FinLimits(), ())
    (step,) = kept_steps(schedule, plants, flown(schedule, trial.vehicle(Axis.YAW), limits=FinLimits(lag=1.5)))
    assert {"overshoot", "settling"} <= set(step.broken)
    assert not step.as_promised


def pitched(rows, goals, seconds, damping, stiffness, authority):
    """Fly goals of pitch, each for `seconds`, with a linear vehicle and one row of gains in steps of 1/50 s."""
    (row,), step = rows, 0.02
    pitch, rate, integral, motion = 0.0, 0.0, 0.0, []
    for i in range(round(len(goals) * seconds / step)):
        goal = goals[int(i * step // seconds)]
        motion.append((i * step, pitch, goal, row.speed))
        wanted = row.gains.kp * (goal - pitch) + row.gains.ki * integral - row.gains.kd * rate + row.reference_gain * goal
        fin = np.clip(wanted, -row.fin_limit, row.fin_limit)
        integral += step * (goal - pitch) * (fin == wanted)
        for _ in range(4):
            rate += 0.25 * step * (authority * fin - damping * rate - stiffness * pitch)
            pitch += 0.25 * step * rate
    time, pitches, held, speed = np.array(motion).T
    return Run("sea", time, {"pitch_rad": pitches, "pitch_goal_rad": held, "surge_m_s": speed})


def test_a_step_of_pitch_is_promised_from_the_pitch_that_it_starts_at(tmp_path):
    (tmp_path / "table.csv").write_text("speed_m_s,c22,c23,d2,Cb\n1.4,1.2,0.5,-0.8,0.0\n")
    source = load_parameter_source([tmp_path / "table.csv"])
    made = design_schedule(source, LIMIT, wish=Wish("pid"))
    run = pitched(made.rows, (0.0, 0.17, -0.14, 0.0), 40.0, 1.2, 0.5, -0.8)
    _, across, back = kept_steps(made, models_plants(source, FinLimits(), ()), run)
    assert (across.broken, back.broken) == ((), ())
    assert across.flown.overshoot == pytest.approx(across.promised.overshoot, abs=0.01)


def test_an_overshoot_within_what_a_flight_is_off_its_model_is_as_promised(schedule):
    plants = models_plants(source_of(trial.vehicle(Axis.YAW)), FinLimits(), ())
    (step,) = kept_steps(schedule, plants, flown(schedule, trial.vehicle(Axis.YAW)))

    def with_overshoot(beyond):
        most = step.promised.overshoot_most + beyond
        return replace(step, noise=0.0, flown=FlownStep(most, step.promised.settling, 0.0)).broken

    assert with_overshoot(0.008) == ()
    assert with_overshoot(0.015) == ("overshoot",)


def test_a_run_without_a_goal_says_what_to_map(schedule):
    run = flown(schedule, trial.vehicle(Axis.YAW))
    plants = models_plants(source_of(trial.vehicle(Axis.YAW)), FinLimits(), ())
    with pytest.raises(DataError, match="told to hold"):
        kept_steps(schedule, plants, Run("sea", run.time, {"yaw_rad": run["yaw_rad"]}))
    with pytest.raises(DataError, match="no step"):
        kept_steps(schedule, plants, Run("sea", run.time, run.signals | {"yaw_goal_rad": 0.0 * run.time}))


def test_compare_takes_gains_and_the_runs_flown_with_them(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run_cli("init", "sea").code == 0
    monkeypatch.chdir(tmp_path / "sea")
    model = trial.vehicle(Axis.YAW)
    save_model(model, tmp_path / "sea/models/hull.yaml")
    assert run_cli("schedule", "design", "--speeds", SPEED, "--fin-max", LIMIT, "-o", "gains.yaml").code == 0
    made = design_schedule(source_of(model), LIMIT, speeds=[SPEED])
    save_run(flown(made, model), tmp_path / "sea/runs/sea.parquet")
    answer = run_cli("compare", "gains.yaml", "--json")
    assert answer.json["as_promised"]
    assert answer.json["headline"]["says"].startswith("as promised, 1 step: ")
    save_run(flown(made, model, limits=FinLimits(lag=1.5)), tmp_path / "sea/runs/sea.parquet", force=True)
    slow = run_cli("compare", "gains.yaml", "runs/sea.parquet", "--json").json
    assert not slow["as_promised"]
    assert slow["headline"]["next"] == "sysid compare"  # which takes the model and the run from here
    for name, share in (("deaf", 1.0), ("mute", 1.1)):
        aimless = flown(made, model)
        save_run(Run(name, aimless.time, {"yaw_rad": share * aimless["yaw_rad"]}), tmp_path / f"sea/runs/{name}.parquet")
    none = run_cli("compare", "gains.yaml", "runs/deaf.parquet", "runs/mute.parquet")
    assert none.code == 2
    assert none.err.count("does not say what the autopilot was told to hold") == 2
    assert "no log is left that can be used" in none.err
