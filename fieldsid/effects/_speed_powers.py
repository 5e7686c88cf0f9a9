"""Damping, authority and cross state at another speed than the one that a run's parameters hold at."""

from __future__ import annotations

import numpy as np

from fieldsid.models.effect import Terms, Values
from fieldsid.numerics.arrays import FloatArray

MIN_SPEED_RATIO = 0.05
"""Share of the run's speed below which a hull that stops or backs is held, since the law has no meaning there."""


def speed_powers(values: Values, ratio: FloatArray, run: float = 1.0) -> Terms:
    """Return the factors (n,) of a speed that is `ratio` (n,) of the run's, as `speed_varying` has it, constant without that.

    `run` is what the run's own speed is over the one that its parameters are for: the factors of both are multiplied.
    """
    log = np.log(np.maximum(ratio, MIN_SPEED_RATIO))  # one logarithm for all powers: half of their time
    factor = run * np.exp(values.get("speed_share", 0.0) * log)
    damping = run * np.exp(values["damping_share"] * log) if "damping_share" in values else factor
    return Terms(damping_factor=damping, authority_factor=factor * factor, cross_factor=factor)
