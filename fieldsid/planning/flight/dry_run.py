"""A dry run: the simulation of a maneuver by a model with all its effects, or of a run's fin, as a Run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from fieldsid.dynamics.free_run import Trajectory, command_record, simulate
from fieldsid.logs.run import STEP_LINES, Run
from fieldsid.maneuvers import Limits, Maneuver, Parameters, Schedule, fly
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model
from fieldsid.models.record import ROLES, Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.flight.operating_point import OperatingPoint, autopilot_of, operating_point

Helpers = Callable[[FloatArray], Mapping[str, FloatArray]]
"""helpers(time (n,) s) -> helper signals (n,) by role: surge, thrust, roll, depth."""


class ModelPlant:
    """A plant of one vehicle for `maneuvers.fly`; angles are relative to the start, fins to the trim."""

    size = 1

    def __init__(self, scene: OperatingPoint, record: Record) -> None:
        self.scene = scene
        self.record = record
        self.fin = record.fin.copy()
        self.sample = 0

    @property
    def trim(self) -> FloatArray:
        """The fin angle of straight flight (1,), rad."""
        return np.array([self.scene.trim_fin])

    def advance(self, fin: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002 - the clock is the record's
        """Advance by one interval with a constant fin (1,) rad; return angle (1,) rad and rate (1,) rad/s at its end."""
        self.fin[self.sample :] = fin[0] + self.scene.trim_fin
        motion = self.logged()
        self.sample = min(self.sample + 1, self.fin.size - 1)
        return motion.angle[self.sample : self.sample + 1], motion.rate[self.sample : self.sample + 1]

    def logged(self) -> Trajectory:
        """Return the measured motion for the fin so far, whose last angle continues to the record's end."""
        return simulate(self.scene.model, self.record.with_fin(self.fin), state=(0.0, 0.0, 0.0), effects=self.scene.effects)


def dry_run(
    model: Model,
    maneuver: Maneuver,
    parameters: Parameters,
    *,
    speed: float,
    limits: Limits,
    schedule: Schedule | None = None,
    helpers: Helpers | None = None,
) -> Run:
    """Return the Run of a maneuver simulated by a model at a speed (m/s); the autopilot steers where the maneuver does not.

    helpers returns signals that vary during the run; all others are constant. Raises ModelError when the model's authority is
    zero or the motion grows without bound.
    """
    schedule = schedule or Schedule()
    scene = operating_point(model, speed)
    length = schedule.run_up + maneuver.duration(maneuver.checked(parameters)) + schedule.recover
    time = np.arange(round(length * schedule.rate_hz) + 2) / schedule.rate_hz
    signals = {} if helpers is None else dict(helpers(time))
    record = command_record(model.axis, time, np.full(time.size, scene.trim_fin), speed=speed, signals=signals)
    plant = ModelPlant(scene, record)
    flight = fly(maneuver, parameters, plant, limits=limits, autopilot=autopilot_of(scene.base, limits), schedule=schedule)
    fin = flight.fin[:, 0] + scene.trim_fin
    # measured again at the end: with a sensor clock that is early a sample of the log depends on later fin angles
    logged, count = plant.logged(), flight.time.size
    run = run_of(model, flight.time, fin, logged.angle[:count], logged.rate[:count], speed=speed, name=maneuver.name)
    return replace(run, signals={**run.signals, **{ROLES[role]: values[: len(run)] for role, values in signals.items()}})


def run_of(
    model: Model, time: FloatArray, fin: FloatArray, angle: FloatArray, rate: FloatArray, *, speed: float, name: str
) -> Run:
    """Return a Run of simulated arrays (n,) with canonical names; with surge only if the speed is finite."""
    names = NAMES[model.axis]
    signals = {names.angle: angle, names.rate: rate, names.fin: fin}
    if np.isfinite(speed):
        signals["surge_m_s"] = np.full(time.size, speed)
    return Run(name, time, signals)


def replayed(model: Model, record: Record, trajectory: Trajectory) -> Run:
    """Return the Run of a trajectory that was simulated from a record's fin."""
    run = run_of(model, trajectory.time, record.fin, trajectory.angle, trajectory.rate, speed=record.speed, name=record.name)
    lines = () if record.fin_line is None else zip(STEP_LINES[NAMES[model.axis].fin], record.fin_line, strict=True)
    return replace(run, signals={**run.signals, **dict(lines)})


def with_noise(run: Run, model: Model, seed: int) -> Run:
    """Return the Run with white noise of the model's standard deviations added to angle and rate, from a seed."""
    names, rng = NAMES[model.axis], np.random.default_rng(seed)
    noisy = {
        names.angle: run[names.angle] + rng.normal(0.0, model.noise.angle, len(run)),
        names.rate: run[names.rate] + rng.normal(0.0, model.noise.rate, len(run)),
    }
    return replace(run, signals={**run.signals, **noisy})
