"""A Monte Carlo ensemble: draws of the prior simulated together, with their excursions and the share outside the envelope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldsid.maneuvers import Autopilot
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import BoolArray, FloatArray
from fieldsid.planning.belief.prior_model import disturbances, draws_of
from fieldsid.planning.flight.excitation import Excitation, Window, fly_window
from fieldsid.planning.flight.operating_point import OperatingPoint, operating_point
from fieldsid.planning.flight.rule_flight import OperatingPointPlant, plant_of
from fieldsid.planning.safety.envelope import Envelope, excursions_of, outside, track_of

ROLL_SPREAD = 0.4
TRIM_SPREAD = 0.005
"""Standard deviation of the logarithm of the roll factor, and of the autopilot's error of the trim fin (rad)."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """Draws of a prior at one speed with their roll factors (m,); the plant has their disturbance moments and errors of trim."""

    roll: FloatArray
    plant: OperatingPointPlant
    window: Window

    @property
    def scenes(self) -> Sequence[OperatingPoint]:
        """The operating points of the draws."""
        return self.plant.scenes

    def first(self, count: int) -> Ensemble:
        """Return the first draws only."""
        return replace(self, roll=self.roll[:count], plant=self.plant.first(count))


@dataclass(frozen=True, slots=True)
class Flights:
    """The flights of an ensemble: time (n,) s, angle (n, m), tracks (n, m) m, and largest excursions: name -> (m,) rad or m."""

    time: FloatArray
    angle: FloatArray
    along: FloatArray
    side: FloatArray
    excursions: dict[str, FloatArray]

    def outside(self, envelope: Envelope) -> BoolArray:
        """Return a mask (m,) of the draws that leave the envelope."""
        return outside(self.excursions, envelope)


def draw_ensemble(model: Model, speed: float, window: Window, count: int, seed: int) -> Ensemble:
    """Return draws of a prior at a speed (m/s) for simulations over a window."""
    rng = np.random.default_rng(seed)
    scenes = tuple(operating_point(drawn, speed) for drawn in draws_of(model, count, seed))
    n = window.time.size
    moments = disturbances(model, count, n, 1.0 / window.rate_hz, rng)
    lift = np.array([s.base.authority for s in scenes])
    moments = moments + (lift * TRIM_SPREAD * rng.standard_normal(count))[:, None]
    roll = np.exp(ROLL_SPREAD * rng.standard_normal(count))
    return Ensemble(roll, plant_of(scenes, n, window.rate_hz, moments), window)


def fly_ensemble(
    ensemble: Ensemble, candidate: Excitation | FloatArray, envelope: Envelope, autopilot: Autopilot, run_up_m: float
) -> Flights:
    """Return the flights of an ensemble under an excitation or a list of fin angles about trim (rad), see `fly_window`.

    They have one autopilot, that for the prior's mean.
    """
    _, angle, rate = fly_window(ensemble.plant, candidate, ensemble.window, envelope.limits, autopilot)
    step, speed = 1.0 / ensemble.window.rate_hz, ensemble.scenes[0].speed
    axis = ensemble.scenes[0].axis
    far = excursions_of(axis, angle, rate, speed=speed, step=step, run_up=run_up_m, roll_gain=ensemble.roll)
    return Flights(ensemble.window.time[: angle.shape[0]], angle, *track_of(axis, angle, speed, step), far)
