"""What is believed of a hull before its runs: Gaussian in the coefficients, from an ensemble of hulls of seven kinds.

Mean, standard deviation and correlation of 1400 hulls drawn with seed 1 (`python tests/truth/radius_prior.py` makes the
numbers again), from slim torpedoes to flat and tall bodies of 1 to 6 m with rudders of 2 to 20 % of the Munk moment. The
standard deviations are taken 2.5 times: vehicles come that the ensemble does not hold, and with 1.3 times a vehicle
of another hand lay 3.5 of them off in its radius of gyration.
"""

from __future__ import annotations

import math

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.turning.maneuvering.equations import NAMES
from fieldsid.turning.maneuvering.prior_table import CORRELATION, MEAN, STANDARD_DEVIATION

WIDENED = 2.5
VISCOUS_LOG_SD = 1.3


def _viscous(most: float) -> tuple[float, float]:
    """Return mean and standard deviation of the logarithm of a damping that is above `most` in 2.5 of 100."""
    return math.log(most) - 1.96 * VISCOUS_LOG_SD, VISCOUS_LOG_SD


BEYOND = {
    "wash": (0.0, 0.1),
    "sway_viscous": _viscous(0.8),
    "yaw_viscous": _viscous(0.2),
    "yaw_drag": (0.0, 0.5),
    "surge_viscous": _viscous(0.1),
}
"""Means and standard deviations of what the ensemble has not: lift of a rudder in the propeller's race (as an exponent of the
speed), damping that does not go with the speed (low Reynolds number, and half of the vehicle models in use: Fossen 2011,
equation 6.57; logarithms, since water takes energy), and a drag of yawing that is not that of the strips (logarithm). Where
viscous sway damping may be negative, pulses without sway put it at -0.4 and the circle of a short hull 10 % off, now 4 %."""
STALL_LOG_SD = 0.5
"""Fins of low aspect ratio stall anywhere from 15 to 45 deg, and some models of vehicles know no stall."""
UNKNOWN_LENGTH = (2.2, 0.6)
"""Length in m and its logarithm's standard deviation where it is not given: 0.7 to 7 m in 95 of 100."""
GIVEN_LENGTH_LOG_SD = 0.05


def prior(length: float | None) -> tuple[FloatArray, FloatArray]:
    """Return mean (22,) and covariance (22, 22) of the coefficients' vector; `length` in m where the vehicle states it."""
    drawn = slice(1, 1 + len(MEAN))
    (mean, spread), whole = np.array([BEYOND.get(n, (0.0, 0.0)) for n in NAMES]).T.copy(), np.eye(len(NAMES))
    mean[drawn], spread[drawn] = MEAN, np.array(STANDARD_DEVIATION) * WIDENED
    whole[drawn, drawn] = CORRELATION
    spread[NAMES.index("stall")] = STALL_LOG_SD
    about, sd = (length, GIVEN_LENGTH_LOG_SD) if length is not None else UNKNOWN_LENGTH
    mean[0], spread[0] = np.log(about), sd
    return mean, whole * np.outer(spread, spread)
