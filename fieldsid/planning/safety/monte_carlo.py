"""A Monte Carlo ensemble: draws of the prior flown at once, the largest excursion of each, and how many leave the envelope."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldsid.logs.convert.units import GRAVITY
from fieldsid.maneuvers import Autopilot, Schedule
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.belief.prior_model import disturbances, draws_of
from fieldsid.planning.flight.closed_loop import ACTUATOR_ROUNDS, closed_loop, fin_offset, idle_records
from fieldsid.planning.flight.excitation import Excitation, Window, asked_of
from fieldsid.planning.flight.operating_point import OperatingPoint, operating_point
from fieldsid.planning.flight.rule_flight import OperatingPointPlant, fly_operating_points, plant_of
from fieldsid.planning.safety.envelope import Envelope

ROLL_SPREAD = 0.4
TRIM_SPREAD = 0.005
"""Spread of the roll factor (logarithm) and of the trim fin the autopilot has found (rad)."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """Draws of a prior at one speed, each with its disturbance moment (m, n), error of trim fin, and roll factor (m,)."""

    axis: Axis
    scenes: tuple[OperatingPoint, ...]
    moments: FloatArray
    roll: FloatArray
    plant: OperatingPointPlant
    window: Window

    def first(self, count: int) -> Ensemble:
        """Return the first draws only."""
        plant = self.plant.first(count)
        return replace(self, scenes=self.scenes[:count], moments=self.moments[:count], roll=self.roll[:count], plant=plant)


@dataclass(frozen=True, slots=True)
class Flights:
    """The flights of an ensemble: time (n,) s, angle and rate (n, m), and the largest excursions: name -> (m,) rad or m."""

    time: FloatArray
    angle: FloatArray
    rate: FloatArray
    along: FloatArray
    side: FloatArray
    excursions: dict[str, FloatArray]

    def outside(self, envelope: Envelope) -> FloatArray:
        """Return 1 for each draw that left the envelope, (m,)."""
        broken = np.zeros(self.angle.shape[1])
        for name, room in envelope.rooms().items():
            broken = np.maximum(broken, self.excursions[name] > room)
        if envelope.area_length is not None:
            broken = np.maximum(broken, self.excursions["behind"] > 0.0)
        return broken

    def quantiles(self, share: float) -> dict[str, float]:
        """Return a quantile of every excursion."""
        return {k: float(np.quantile(v, share)) for k, v in self.excursions.items()}


def draw_ensemble(model: Model, speed: float, window: Window, count: int, seed: int) -> Ensemble:
    """Return draws of a prior at a speed (m/s), ready to be flown over a window."""
    rng = np.random.default_rng(seed)
    scenes = tuple(operating_point(drawn, speed) for drawn in draws_of(model, count, seed))
    n = window.time.size
    moments = disturbances(model, count, n, 1.0 / window.rate_hz, rng)
    lift = np.array([s.base.authority for s in scenes])
    moments = moments + (lift * TRIM_SPREAD * rng.standard_normal(count))[:, None]
    roll = np.exp(ROLL_SPREAD * rng.standard_normal(count))
    return Ensemble(model.axis, scenes, moments, roll, plant_of(scenes, n, window.rate_hz, moments), window)


def fly_ensemble(crowd: Ensemble, candidate: Excitation, envelope: Envelope, autopilot: Autopilot, run_up_m: float) -> Flights:
    """Return an excitation flown by an ensemble, all under the autopilot that was designed on the prior's mean."""
    if candidate.record.rule is None:
        angle, rate = _open_loop(crowd, asked_of(candidate, crowd.window), envelope, autopilot)
    else:
        schedule = Schedule(crowd.window.rate_hz, crowd.window.lead, crowd.window.recover)
        flight = fly_operating_points(
            crowd.scenes, candidate.record, candidate.parameters,
            limits=envelope.limits, autopilot=autopilot, schedule=schedule, moments=crowd.moments,
        )  # fmt: skip
        n = crowd.window.time.size
        angle, rate = flight.angle[:n], flight.rate[:n]
    return _measured(crowd, angle, rate, run_up_m)


def fly_list(crowd: Ensemble, fins: FloatArray, envelope: Envelope, autopilot: Autopilot, run_up_m: float) -> Flights:
    """Return fins about trim, (n,) rad with NaN for the autopilot, flown open loop by an ensemble, the autopilot after them."""
    asked = np.full(crowd.window.time.size, np.nan)
    count = min(asked.size, fins.size)
    asked[:count] = fins[:count]
    return _measured(crowd, *_open_loop(crowd, asked, envelope, autopilot), run_up_m)


def _open_loop(crowd: Ensemble, asked: FloatArray, envelope: Envelope, autopilot: Autopilot) -> tuple[FloatArray, FloatArray]:
    """Return angle and rate (n, m)."""
    plant, time = crowd.plant, crowd.window.time
    size = (plant.size, time.size)
    command, angle, rate = np.empty(size), np.empty(size), np.empty(size)
    fin, fin_rate = envelope.fin, envelope.fin_rate
    low, high = np.minimum(-fin - plant.trim, 0.0), np.maximum(fin - plant.trim, 0.0)
    limits = np.column_stack([low, high, np.full(plant.size, fin_rate), plant.trim])
    gains = autopilot.gains
    moving = any(e.fin is not None for s in crowd.scenes for e in s.effects)
    off, steps, out = plant.off, np.diff(time), np.empty((time.size, 3))
    rounds = ACTUATOR_ROUNDS if moving else 1
    idle = idle_records(crowd.scenes, time) if moving else {}
    for left in reversed(range(rounds)):
        for i in range(plant.size):
            closed_loop(
                steps, plant.drive[i].copy(), plant.constants[i], plant.pieces, asked, off[i], plant.push[i], gains, limits[i],
                command[i], out,
            )  # fmt: skip
            angle[i], rate[i] = out[:, 0], out[:, 1]
        if left:
            off = np.stack([fin_offset(s, idle, command[i]) for i, s in enumerate(crowd.scenes)])
    return angle.T, rate.T


def _measured(crowd: Ensemble, angle: FloatArray, rate: FloatArray, run_up_m: float) -> Flights:
    """Return the flights with their excursions; the formulas are those of `envelope.excursion_of`."""
    step, speed = 1.0 / crowd.window.rate_hz, crowd.scenes[0].speed
    yaw = crowd.axis is Axis.YAW
    along = np.cumsum(speed * step * np.cos(angle), axis=0)
    side = np.cumsum(speed * step * np.sin(angle), axis=0) * (1.0 if yaw else -1.0)
    most, off = np.max(np.abs(angle), axis=0), np.max(np.abs(side), axis=0)
    none = np.zeros_like(most)
    excursions = {
        "heading": most if yaw else none,
        "track": off if yaw else none,
        "depth": none if yaw else off,
        "pitch": none if yaw else most,
        "roll": crowd.roll * speed * np.max(np.abs(rate), axis=0) / GRAVITY if yaw else none,
        "along": run_up_m + np.max(along, axis=0),
        "behind": np.maximum(0.0, -run_up_m - np.min(along, axis=0)),
        "across": off if yaw else none,
    }
    return Flights(crowd.window.time[: angle.shape[0]], angle, rate, along, side, excursions)
