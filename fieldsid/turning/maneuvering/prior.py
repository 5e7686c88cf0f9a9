"""The prior of a hull's coefficients: Student's t, from an ensemble of hulls of seven kinds.

Mean, standard deviation and correlation are those of 1400 hulls drawn with seed 1 (`python tests/truth/radius_prior.py` computes
them), from slim torpedoes to flat and tall bodies of 1 to 6 m with rudders of 2 to 20 % of the Munk moment. A vehicle outside the
ensemble as a rule differs from it in one coefficient (in one published model the radius of gyration is 4.5 standard deviations
off) and is like it in the others: each coordinate therefore has heavy tails of its own, with the scale of the ensemble. With
pulses only (`radius_table.py --seed 11`, hulls 14 to 47) the error of the radius is then 4.8 % rms and 14.5 % at worst, against
6.0 and 18.2 % with a Gaussian of 2.5 times the scale; for an earlier hull 21 against 47 %. On two vehicles outside the ensemble
(tests/field, tests/recovery) the choice changes it by less than 1.5 %.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.turning.maneuvering.equations import NAMES
from fieldsid.turning.maneuvering.prior_table import CORRELATION, MEAN, STANDARD_DEVIATION

FREEDOM = 4.0
"""Degrees of freedom of Student's t: with these one vehicle in a hundred is five standard deviations off (Gelman and others 2013,
chapter 17: models for robust inference)."""
FARTHEST_COST = 67.1
"""The 99.9 % quantile of the cost over two million draws of the prior: a fit with a higher cost is in a wrong minimum, or the
equations do not describe the vehicle."""
VISCOUS_LOG_SPREAD = 2.6


def _viscous(most: float) -> tuple[float, float]:
    """Return mean and scale of the logarithm of a damping that exceeds `most` in 5 % of vehicles and is negligible in half.

    Half of the vehicle models in use have it (Fossen 2011, equation 6.57), half do not: the median is 0.4 % of `most`.
    """
    return math.log(most) - 2.13 * VISCOUS_LOG_SPREAD, VISCOUS_LOG_SPREAD


BEYOND = {
    "wash": (0.0, 0.1),
    "sway_viscous": _viscous(0.8),
    "yaw_viscous": _viscous(0.2),
    "yaw_drag": (0.0, 0.5),
    "surge_viscous": _viscous(0.1),
}
"""Means and scales of coefficients that the ensemble lacks: the lift of a rudder in the propeller's race (an exponent of the
speed), damping that is independent of the speed (low Reynolds number; logarithms, because damping dissipates), and the yaw drag
over that of the strips (logarithm). If viscous sway damping could be negative, pulses without measured sway would put it at -0.4
and the
circle of a short hull 10 % off; if all hulls had some, the circle of another would be 15 % off and not 10 %."""
STALL_LOG_SPREAD = 0.5
"""Scale of the logarithm of the stall angle: fins of low aspect ratio stall between 15 and 45 deg; some models have no stall."""
UNKNOWN_LENGTH = (2.2, 0.6)
"""Length in m, and scale of its logarithm, where it is not stated: 0.7 to 7 m in 88 % of cases."""
GIVEN_LENGTH_LOG_SPREAD = 0.05


@dataclass(frozen=True, slots=True)
class Prior:
    """Independent Student's t in the coordinates z = axes (vector - mean), with axes (22, 22) and mean (22,)."""

    mean: FloatArray
    axes: FloatArray

    def cost(self, vector: FloatArray) -> float:
        """Return minus twice the log density at a vector, less that at the mean."""
        away = self.axes @ (vector - self.mean)
        return float(np.sum((FREEDOM + 1.0) * np.log1p(away**2 / FREEDOM)))

    def precision(self, vector: FloatArray) -> FloatArray:
        """Return the matrix (22, 22) of the quadratic form about the mean that majorises the cost and touches it at `vector`."""
        away = self.axes @ (vector - self.mean)
        return np.asarray(self.axes.T * ((FREEDOM + 1.0) / (FREEDOM + away**2)) @ self.axes, dtype=np.float64)


def prior(length: float | None) -> Prior:
    """Return the prior of the vector; `length` in m where the vehicle states it."""
    drawn = slice(1, 1 + len(MEAN))
    (mean, scale), correlation = np.array([BEYOND.get(n, (0.0, 0.0)) for n in NAMES]).T.copy(), np.eye(len(NAMES))
    mean[drawn], scale[drawn] = MEAN, STANDARD_DEVIATION
    correlation[drawn, drawn] = CORRELATION
    scale[NAMES.index("stall")] = STALL_LOG_SPREAD
    middle, length_scale = (length, GIVEN_LENGTH_LOG_SPREAD) if length is not None else UNKNOWN_LENGTH
    mean[0], scale[0] = np.log(middle), length_scale
    values, vectors = np.linalg.eigh(correlation)
    return Prior(mean, vectors / np.sqrt(values) @ vectors.T / scale)
