"""How finely and how long a loop is flown, and what disturbs it: by the time constants of its plant, not by a clock of its own.

With the whole fin at the largest error a plant answers within 1/w, w^2 = k + |b| delta/e. Loops between the two bandwidths below
are flown at one pace, for 60 s in steps of 0.02 s; slower and quicker ones for as many steps that are as much longer or shorter.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray
from fieldsid.schedule.linear_plant import LinearPlant

STEP_S, FLIGHT_S = 0.02, 60.0
SLOWEST_RAD_S, QUICKEST_RAD_S = 25.0 / FLIGHT_S, 2.0
"""Bandwidths of the full fin: below the first 60 s are fewer than 25 times 1/w, above the second 0.02 s are coarse."""
LEAST_RAD_S = 1e-4
"""No fin is so weak."""
LARGEST_TURN = 0.2
"""Of the hull's fastest own motion in one step, rad: the midpoint rule is off by less than a hundredth of it."""
LONGER = (1.0, 2.0, 4.0)
"""What has not come to rest is flown twice as long, and twice as long again."""


@dataclass(frozen=True, slots=True)
class Pace:
    """Time step and length of a flight, s."""

    step: float = STEP_S
    flight: float = FLIGHT_S

    @property
    def longest(self) -> float:
        """How long a step is flown that does not come to rest, s."""
        return LONGER[-1] * self.flight

    @property
    def leg(self) -> float:
        """How long a straight leg and a step of depth are flown, s."""
        return 2.0 * self.flight


def full_bandwidth(plant: LinearPlant, fin_limit: float, error: float) -> float:
    """Return the bandwidth (rad/s) of the estimate that uses the full fin at an error (rad): faster would only saturate."""
    return float(np.sqrt(max(plant.stiffness[0], 0.0) + abs(plant.slow_authority[0]) * fin_limit / error))


def pace_of(plant: LinearPlant, fin_limit: float, error: float) -> Pace:
    """Return the pace of a plant whose fin is limited to +/-fin_limit rad, for steps about `error` rad."""
    bandwidth = max(full_bandwidth(plant, fin_limit, error), LEAST_RAD_S)
    times = SLOWEST_RAD_S / min(bandwidth, SLOWEST_RAD_S) * QUICKEST_RAD_S / max(bandwidth, QUICKEST_RAD_S)
    damping, stiffness, crossed, of_rate, of_fin = plant.straight
    own = (damping, np.sqrt(np.abs(stiffness)), np.where((of_rate != 0.0) | (of_fin != 0.0), crossed, 0.0))
    fastest = max(float(np.max(np.abs(part))) for part in own)
    most = max(LARGEST_TURN / max(fastest, LEAST_RAD_S), STEP_S)
    return Pace(STEP_S * times if times <= 1.0 else min(STEP_S * times, most), FLIGHT_S * times)


LEG_SEED = 5


def disturbance_moment(noise: Noise | None, pace: Pace) -> FloatArray:
    """Return a moment (t,) in rad/s^2, one value for each time step of a pace: zero where no model has measured any."""
    count = round(pace.leg / pace.step) + 1
    if noise is None or not noise.disturbance > 0.0:
        return np.zeros(count)
    keep = float(np.exp(-pace.step / max(noise.disturbance_time, pace.step)))
    white = np.random.default_rng(LEG_SEED).standard_normal(count) * np.sqrt(1.0 - keep**2)
    return noise.disturbance * np.array(list(accumulate(white.tolist(), lambda moment, now: keep * moment + now)))
