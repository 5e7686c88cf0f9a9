"""The disturbance moment of a straight leg, an AR(1) as a model's own runs had it."""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray
from fieldsid.schedule.flown.pace import Pace

LEG_SEED = 5


def disturbance_moment(noise: Noise | None, pace: Pace) -> FloatArray:
    """Return a moment (t,) in rad/s^2, one value for each time step of a pace: zero where no model has measured any."""
    count = round(pace.leg / pace.step) + 1
    if noise is None or not noise.disturbance > 0.0:
        return np.zeros(count)
    keep = float(np.exp(-pace.step / max(noise.disturbance_time, pace.step)))
    white = np.random.default_rng(LEG_SEED).standard_normal(count) * np.sqrt(1.0 - keep**2)
    return noise.disturbance * np.array(list(accumulate(white.tolist(), lambda moment, now: keep * moment + now)))
