"""The zig-zag test: the fin is reversed each time the heading passes a set angle on the side to which the fin turns it."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, amplitude, side
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit

SIDE, SENSE, LEFT = range(3)
"""Columns of the memory: side of the fin, sign of the response to a positive fin (0 if not known yet), remaining reversals."""


@jit
def _rule(values: FloatArray, time: float, angle: FloatArray, rate: FloatArray, memory: FloatArray, fin: FloatArray) -> None:
    most, turn, duration = values[0], values[1], values[4]
    for i in range(fin.shape[0]):
        if abs(angle[i]) >= turn:
            # The first crossing shows the sign of the authority, which need not be known before.
            if memory[i, SENSE] == 0.0:
                memory[i, SENSE] = np.sign(angle[i]) * memory[i, SIDE]
            if angle[i] * memory[i, SENSE] * memory[i, SIDE] > 0.0:
                memory[i, SIDE] *= -1.0
                memory[i, LEFT] -= 1.0
        fin[i] = np.nan if memory[i, LEFT] < 0.0 or time >= duration else most * memory[i, SIDE]


MANEUVER = Maneuver(
    name="zigzag",
    says="the fin is put over each time the heading has passed a set angle, 10/10 or 20/20 degrees",
    parameters=(
        amplitude(0.17453292519943295),
        Parameter("turn", "rad", 0.02, 3.0, 0.17453292519943295, "heading (or pitch) at which the fin is put over"),
        Parameter("reversals", "", 1, 20, 4, "number of times the fin is put over", whole=True),
        Parameter("mirrored", "", 0, 1, 0, "1 starts to the other side", whole=True, tuned=False),
        Parameter("duration", "s", 2.0, 600.0, 60.0, "ends here even if the heading was not reached", tuned=False),
    ),
    duration=lambda p: p["duration"],
    rule=_rule,
    memory=lambda p: (side(p), 0.0, p["reversals"]),
    source="ITTC 7.5-04-02-01, zig-zag test; IMO MSC.137(76)",
)
