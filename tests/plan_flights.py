"""Planned commands flown by the truth simulator, with a day's noise, and fitted: what a plan promised against what came."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from truth import kernel, noise
from truth.maneuvers import Maneuver as TruthManeuver
from truth.noise import Clock
from truth.physics import Physics
from truth.simple import fly

from fieldsid.fitting.fit import fit
from fieldsid.logs.run import Run
from fieldsid.maneuvers import Limits, Schedule
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import record_of
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.planning.flight.excitation import Excitation, Window, fin_command
from fieldsid.planning.flight.operating_point import autopilot_of, operating_point
from fieldsid.planning.flight.rule_flight import fly_maneuver, plant_of

SENSOR = float(np.radians(0.3))
PAPER = {1.07: (1.04, -0.62, -0.0086), 1.36: (1.11, -0.86, -0.0082), 2.19: (1.10, -1.83, -0.0021)}
"""Speed m/s: a22, b2, C0 of the paper's table 2."""


@dataclass(frozen=True)
class Day:
    """What the truth is and what disturbs it: sensor noise in rad and rad/s, a disturbance moment in rad/s^2."""

    physics: Physics
    speed: float
    sensor: float = SENSOR
    disturbance: float = 0.0
    disturbance_time: float = 1.0
    axis: Axis = Axis.YAW


def paper_day(speed: float = 1.36, disturbance: float = 0.0) -> Day:
    """The paper's vehicle at one of its speeds."""
    a22, b2, trim = PAPER[speed]
    physics = Physics(damping=a22, authority=b2, trim=trim, nominal_speed=speed, fin_limit=0.26, kp=0.35, kd=0.0)
    return Day(physics, speed, disturbance=disturbance)


def believed(day: Day, relative: float = 0.15, offset: float = 1.1) -> Model:
    """What is believed before the dive: the truth off by `offset`, known to `relative`."""
    values = {"a22": day.physics.damping * offset, "b2": day.physics.authority / offset, "C0": day.physics.trim}
    errors = [relative * abs(values["a22"]), relative * abs(values["b2"]), 0.005]
    measured = Noise(day.sensor, day.sensor, day.disturbance, day.disturbance_time)
    return Model(day.axis, (), values, {}, tuple(values), np.diag(errors) ** 2, SpeedLaw(day.speed), measured, method="prior")


def exact(day: Day) -> Model:
    """The truth as a model: what the standard errors are predicted from when they are compared with fits."""
    return believed(day, relative=0.01, offset=1.0)


def orders(day: Day, candidate: Excitation, window: Window) -> TruthManeuver:
    """What the truth is told: the planned command about its own trim, or its own zig-zag rule for as long as planned."""
    if candidate.record.rule is None:
        asked = fin_command(candidate, window)
        trim = np.where(np.isnan(asked), 0.0, -day.physics.trim / day.physics.authority)
        return TruthManeuver("planned", np.nan_to_num(asked) + trim, np.where(np.isnan(asked), kernel.HOLD, kernel.OPEN))
    scene = operating_point(exact(day), day.speed)
    limits = Limits(day.physics.fin_limit)
    schedule = Schedule(window.rate_hz, window.lead, window.recover)
    flight = fly_maneuver(
        plant_of([scene], window.time.size, window.rate_hz),
        candidate.record,
        candidate.parameters,
        limits=limits,
        autopilot=autopilot_of(scene.base, limits),
        schedule=schedule,
    )
    time = window.time
    inside = (time >= flight.excitation[0] - 1e-9) & (time < flight.excitation[1] - 1e-9)
    if candidate.maneuver == "turning_circle":
        # As far as the circle was expected to last; then the truth's pilot keeps the course it has come to.
        fin = np.interp(time, flight.time, flight.fin[:, 0])
        return TruthManeuver("circle", np.where(inside, fin, 1.0), np.where(inside, kernel.OPEN, kernel.HOLD))
    settings = {"zigzag_fin": candidate.parameters["amplitude"], "zigzag_angle": candidate.parameters["turn"]}
    return TruthManeuver("zigzag", np.zeros(time.size), np.where(inside, kernel.ZIGZAG, kernel.HOLD), settings)


def flown(day: Day, candidate: Excitation, window: Window, seed: int) -> Run:
    """A candidate flown by the truth and measured with the day's noise."""
    rng = np.random.default_rng(seed)
    size = window.time.size
    clock = Clock(1.0 / window.rate_hz, size)
    maneuver = orders(day, candidate, window)
    inputs = noise.calm(clock, day.physics.nominal_thrust)
    if day.disturbance > 0:
        inputs[kernel.DISTURBANCE] = noise.ar1(rng, clock.total, day.disturbance, day.disturbance_time, clock.sample)
    motion = fly(day.physics, clock, maneuver, inputs, pitching=day.axis is Axis.PITCH, step=0.01)
    names = NAMES[day.axis]
    signals = {
        names.angle: motion.angle + noise.white(rng, size, day.sensor),
        names.rate: motion.rate + noise.white(rng, size, day.sensor),
        names.fin: motion.command,
        "surge_m_s": np.full(size, day.speed),
    }
    return Run("planned", motion.time, signals)


def scatter(day: Day, candidate: Excitation, window: Window, seeds: range, method: str = "output_error") -> dict[str, float]:
    """Standard deviation of every fitted parameter over seeds: the standard error as it really is."""
    found = []
    for seed in seeds:
        made = fit([record_of(flown(day, candidate, window, seed), day.axis)], day.axis, method=method)
        found.append([made.model.values[n] for n in NAMES[day.axis].base])
    return dict(zip(NAMES[day.axis].base, np.std(found, axis=0, ddof=1).tolist(), strict=True))
