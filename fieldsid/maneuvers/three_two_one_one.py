"""The 3-2-1-1: pulses of alternating sign and decreasing length, of a wider bandwidth than a doublet."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude, levels
from fieldsid.numerics.arrays import FloatArray

LENGTHS = np.array([3.0, 2.0, 1.0, 1.0])
SIDES = np.array([1.0, -1.0, 1.0, -1.0])


def _command(p: Parameters, time: FloatArray) -> FloatArray:
    count = round(p["repeats"])
    # every other repeat is mirrored: one pattern leaves a net turn of one unit, two opposite ones leave none
    sides = np.concatenate([SIDES * (-1.0) ** i for i in range(count)])
    return levels(time, np.tile(LENGTHS, count) * p["unit"], p["amplitude"] * sides)


MANEUVER = Maneuver(
    name="three_two_one_one",
    says="pulses of 3, 2, 1 and 1 units with alternating side, then mirrored: several frequencies in one go",
    parameters=(
        amplitude(0.26),
        Parameter("unit", "s", 0.1, 10.0, 1.0, "length of the shortest pulse"),
        Parameter("repeats", "", 1, 10, 2, "number of patterns, every other one mirrored", whole=True),
    ),
    duration=lambda p: float(LENGTHS.sum() * p["unit"] * p["repeats"]),
    command=_command,
    source="Plaetschke and Schulz 1979, AGARD LS-104; Jategaonkar 2006, section 2.3",
)
