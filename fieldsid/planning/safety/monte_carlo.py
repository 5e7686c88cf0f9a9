"""A Monte Carlo ensemble: draws of the prior flown at once, the largest excursion of each, and how many leave the envelope."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldsid.maneuvers import Autopilot, Schedule
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import BoolArray, FloatArray
from fieldsid.planning.belief.prior_model import disturbances, draws_of
from fieldsid.planning.flight.excitation import Excitation, Window, asked_of
from fieldsid.planning.flight.operating_point import OperatingPoint, operating_point
from fieldsid.planning.flight.rule_flight import OperatingPointPlant, fly_fins, fly_operating_points, plant_of
from fieldsid.planning.safety.envelope import Envelope, excursions_of, track_of, used

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
    """The flights of an ensemble: time (n,) s, angle (n, m), tracks (n, m) m, and largest excursions: name -> (m,) rad or m."""

    time: FloatArray
    angle: FloatArray
    along: FloatArray
    side: FloatArray
    excursions: dict[str, FloatArray]

    def outside(self, envelope: Envelope) -> BoolArray:
        """Return which draws left the envelope, (m,)."""
        return np.asarray(used(self.excursions, envelope) > 1.0)


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
        asked = asked_of(candidate, crowd.window)
        _, angle, rate = fly_fins(crowd.scenes, crowd.plant, crowd.window.time, asked, envelope.limits, autopilot)
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
    _, angle, rate = fly_fins(crowd.scenes, crowd.plant, crowd.window.time, asked, envelope.limits, autopilot)
    return _measured(crowd, angle, rate, run_up_m)


def _measured(crowd: Ensemble, angle: FloatArray, rate: FloatArray, run_up_m: float) -> Flights:
    """Return the flights with their excursions."""
    step, speed = 1.0 / crowd.window.rate_hz, crowd.scenes[0].speed
    far = excursions_of(crowd.axis, angle, rate, speed=speed, step=step, run_up=run_up_m, roll_gain=crowd.roll)
    return Flights(crowd.window.time[: angle.shape[0]], angle, *track_of(crowd.axis, angle, speed, step), far)
