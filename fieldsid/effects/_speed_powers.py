"""Factors of damping, authority and cross state at a speed other than the one at which a run's parameters hold."""

from __future__ import annotations

import numpy as np

from fieldsid.models.effect import Terms, Values
from fieldsid.numerics.arrays import FloatArray

MIN_SPEED_RATIO = 0.05
"""Lower limit of the speed over the run's speed: the power law has no meaning for a hull that stops or backs."""


def speed_powers(values: Values, ratio: FloatArray, run: float = 1.0) -> Terms:
    """Return the factors (n,) at `ratio` (n,) times the run's speed by the exponents of `speed_varying`, zero if it is absent.

    `run` is the run's speed over the speed at which its parameters hold; it multiplies the factors.
    """
    log = np.log(np.maximum(ratio, MIN_SPEED_RATIO))  # one logarithm for all powers: half of their time
    factor = run * np.exp(values.get("speed_share", 0.0) * log)
    damping = run * np.exp(values["damping_share"] * log) if "damping_share" in values else factor
    return Terms(damping_factor=damping, authority_factor=factor * factor, cross_factor=factor)
