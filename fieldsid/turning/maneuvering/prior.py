"""What is believed of a hull before its runs: Student's t in the coefficients, from an ensemble of hulls of seven kinds.

Mean, standard deviation and correlation of 1400 hulls drawn with seed 1 (`python tests/truth/radius_prior.py` makes the
numbers again), from slim torpedoes to flat and tall bodies of 1 to 6 m with rudders of 2 to 20 % of the Munk moment. Vehicles
come that the ensemble does not hold, as a rule in one of their coefficients (one of another hand has a radius of gyration 4.5
standard deviations off) and like the ensemble in the others: so each has tails of its own, and the spread of the ensemble.
Of pulses alone (`radius_table.py --seed 11`, hulls 14 to 47) the radius is then off by 4.8 %, rms, and 14.5 % at worst, in
place of 6.0 and 18.2 % with a Gaussian of 2.5 times the spread; of one hull before these by 21 in place of 47 %. On two
vehicles that are not of the ensemble (tests/field, tests/recovery) it is within 1.5 % of what it was.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.turning.maneuvering.equations import NAMES
from fieldsid.turning.maneuvering.prior_table import CORRELATION, MEAN, STANDARD_DEVIATION

FREEDOM = 4.0
"""Degrees of freedom of Student's t: few enough that five standard deviations are one vehicle in a hundred (Gelman and others
2013, chapter 17: models for robust inference)."""
FARTHEST_COST = 67.1
"""999 of 1000 draws of the prior cost less (two million of them): a fit farther from every vehicle of the ensemble is in a
wrong minimum, or the equations are not those of the vehicle."""
VISCOUS_LOG_SPREAD = 2.6


def _viscous(most: float) -> tuple[float, float]:
    """Return mean and spread of the logarithm of a damping above `most` in 5 of 100, and of no effect in half of them.

    Half of the vehicle models in use have it (Fossen 2011, equation 6.57), half have none: the median is 0.4 % of `most`.
    """
    return math.log(most) - 2.13 * VISCOUS_LOG_SPREAD, VISCOUS_LOG_SPREAD


BEYOND = {
    "wash": (0.0, 0.1),
    "sway_viscous": _viscous(0.8),
    "yaw_viscous": _viscous(0.2),
    "yaw_drag": (0.0, 0.5),
    "surge_viscous": _viscous(0.1),
}
"""Means and spreads of what the ensemble has not: lift of a rudder in the propeller's race (as an exponent of the speed),
damping that does not go with the speed (low Reynolds number; logarithms, since water takes energy), and a drag of yawing that
is not that of the strips (logarithm). Where viscous sway damping may be negative, pulses without sway put it at -0.4 and the
circle of a short hull 10 % off; where all hulls have some, the circle of another 15 % off, now 10 %."""
STALL_LOG_SPREAD = 0.5
"""Fins of low aspect ratio stall anywhere from 15 to 45 deg, and some models of vehicles know no stall."""
UNKNOWN_LENGTH = (2.2, 0.6)
"""Length in m and its logarithm's spread where it is not given: 0.7 to 7 m in 88 of 100."""
GIVEN_LENGTH_LOG_SPREAD = 0.05


@dataclass(frozen=True, slots=True)
class Prior:
    """Independent Student's t in the coordinates z = `axes` (vector - `mean`), (22, 22) and (22,)."""

    mean: FloatArray
    axes: FloatArray

    def cost(self, vector: FloatArray) -> float:
        """Return minus twice the log density at a vector, less its least."""
        away = self.axes @ (vector - self.mean)
        return float(np.sum((FREEDOM + 1.0) * np.log1p(away**2 / FREEDOM)))

    def precision(self, vector: FloatArray) -> FloatArray:
        """Return the matrix (22, 22) whose quadratic form about the mean has the cost's slope at a vector and lies above it."""
        away = self.axes @ (vector - self.mean)
        return np.asarray(self.axes.T * ((FREEDOM + 1.0) / (FREEDOM + away**2)) @ self.axes, dtype=np.float64)


def prior(length: float | None) -> Prior:
    """Return what is believed of the coefficients' vector; `length` in m where the vehicle states it."""
    drawn = slice(1, 1 + len(MEAN))
    (mean, spread), whole = np.array([BEYOND.get(n, (0.0, 0.0)) for n in NAMES]).T.copy(), np.eye(len(NAMES))
    mean[drawn], spread[drawn] = MEAN, STANDARD_DEVIATION
    whole[drawn, drawn] = CORRELATION
    spread[NAMES.index("stall")] = STALL_LOG_SPREAD
    about, wide = (length, GIVEN_LENGTH_LOG_SPREAD) if length is not None else UNKNOWN_LENGTH
    mean[0], spread[0] = np.log(about), wide
    share, along = np.linalg.eigh(whole)
    return Prior(mean, along / np.sqrt(share) @ along.T / spread)
