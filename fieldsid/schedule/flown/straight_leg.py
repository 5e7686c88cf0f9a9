"""A straight leg in the disturbance moment that a model's own runs had: an AR(1) moment, the heading and the fin under it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

import numpy as np

from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray
from fieldsid.schedule.flown.pace import Pace
from fieldsid.schedule.flown.response import Steps, leg_response
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.record import Row

LEG_SEED = 5


def disturbance_moment(noise: Noise | None, pace: Pace | None = None) -> FloatArray:
    """Return a moment (t,) in rad/s^2, one value for each time step of a pace: zero where no model has measured any."""
    pace = pace or Pace()
    count = round(pace.leg / pace.step) + 1
    if noise is None or not noise.disturbance > 0.0:
        return np.zeros(count)
    keep = float(np.exp(-pace.step / max(noise.disturbance_time, pace.step)))
    white = np.random.default_rng(LEG_SEED).standard_normal(count) * np.sqrt(1.0 - keep**2)
    return noise.disturbance * np.array(list(accumulate(white.tolist(), lambda moment, now: keep * moment + now)))


def straight_leg(plant: LinearPlant, rows: Sequence[Row] | Row, noise: Noise | None, pace: Pace | None = None) -> Steps:
    """Return the leg flown by every draw of a plant at a pace."""
    pace = pace or Pace()
    return leg_response(plant, rows, push=disturbance_moment(noise, pace), step_s=pace.step)
