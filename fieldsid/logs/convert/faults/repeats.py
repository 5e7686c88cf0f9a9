"""A sensor slower than its table's rows, whose last number is repeated until the next: a repeat is no measurement.

Fitted as one, the signal would be late by half of its own step, and its noise would count several times.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

FEWEST = 10
"""Changes from which on their places are judged."""


def without_repeats(name: str, values: FloatArray) -> tuple[FloatArray, list[Note]]:
    """Return a signal (n,) with the repeats of its slower sensor missing, and the note that says so; itself where it has none."""
    seen = np.flatnonzero(np.isfinite(values))
    changed = np.flatnonzero(np.diff(values[seen]) != 0.0)
    every = _held_for(changed)
    if every == 1:
        return values, []
    own = np.full(values.shape, np.nan)
    fresh = seen[(changed[0] + 1) % every :: every]
    own[fresh] = values[fresh]
    message = (
        f"{name} changes at every {every}th sample only ({changed.size} times): it was taken at a lower rate, and repeated until "
        "the next; the repeats are missing now"
    )
    return own, [Note("repeated", message, {"signal": name, "value": every, "count": changed.size})]


def _held_for(changed: npt.NDArray[np.intp]) -> int:
    """Return for how many samples numbers are held, by the places (k,) before a change; 1 where it is not for always as many.

    That k changes fall on every m-th sample by chance has the probability m^(1-k): ten are no chance. A number that comes twice
    is held for twice as long.
    """
    if changed.size < FEWEST:
        return 1
    apart = np.diff(changed)
    every = int(np.gcd.reduce(apart))
    return every if every == int(np.median(apart)) else 1
