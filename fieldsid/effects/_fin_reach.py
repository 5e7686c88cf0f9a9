"""Start values of a fin angle at which a static map has a corner: shares of the largest angle that was commanded.

A corner shows only in data where the fin was beyond it, and a vehicle that steers with 3 degrees has it at other angles than
one that steers with 30.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fieldsid.models.effect import Coefficient
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray


def shares_of_reach(coefficient: Coefficient, shares: Sequence[float]) -> Callable[..., list[dict[str, float]]]:
    """Return the hook `initial_guesses` of a coefficient (rad): these shares of the largest fin angle, within its bounds."""

    def initial_guesses(records: Sequence[Record], _residuals: Sequence[FloatArray]) -> list[dict[str, float]]:
        reach = max(float(np.abs(r.fin).max()) for r in records)
        angles = dict.fromkeys(min(max(s * reach, coefficient.low), coefficient.high) for s in shares)
        return [{coefficient.name: angle} for angle in angles]

    return initial_guesses
