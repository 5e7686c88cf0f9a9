"""A pseudo-random binary sequence: the fin jumps between two angles at the clock of a shift register."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude
from fieldsid.numerics.arrays import FloatArray

TAPS = {3: (3, 2), 4: (4, 3), 5: (5, 3), 6: (6, 5), 7: (7, 6), 8: (8, 6, 5, 4), 9: (9, 5), 10: (10, 7)}
"""Feedback taps that give the longest sequence, 2^order - 1 bits (Ljung 1999, table 13.1)."""


def bits(order: int, count: int, seed: int) -> FloatArray:
    """Return `count` values of -1 or 1 from a shift register of `order` stages started at `seed`."""
    state = seed % (2**order - 1) + 1
    out = np.empty(count)
    for i in range(count):
        out[i] = 1.0 if state & 1 else -1.0
        feedback = 0
        for tap in TAPS[order]:
            feedback ^= (state >> (order - tap)) & 1
        state = (state >> 1) | (feedback << (order - 1))
    return out


def _command(p: Parameters, time: FloatArray) -> FloatArray:
    count = int(np.ceil(p["duration"] / p["bit"]))
    values = bits(round(p["order"]), count, round(p["seed"]))
    index = np.floor(time / p["bit"] + 1e-9).astype(np.int64)
    fin = p["amplitude"] * values[np.clip(index, 0, count - 1)]
    return np.where(time < -1e-9, 0.0, np.where(time < p["duration"] - 1e-9, fin, np.nan))


MANEUVER = Maneuver(
    name="prbs",
    says="the fin jumps between two angles in a pseudo-random pattern: white in effect up to the bit rate",
    parameters=(
        amplitude(0.2),
        Parameter("bit", "s", 0.1, 20.0, 1.0, "shortest time between two jumps"),
        Parameter("order", "", 3, 10, 5, "stages of the shift register", whole=True),
        Parameter("seed", "", 0, 1023, 7, "where in the sequence it starts", whole=True),
        Parameter("duration", "s", 2.0, 600.0, 31.0, "length", tuned=False),
    ),
    duration=lambda p: p["duration"],
    command=_command,
    source="Ljung 1999, System Identification, section 13.3",
)
