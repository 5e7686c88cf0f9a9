"""The zig-zag test: the fin is reversed each time the heading has passed a set angle on the side it turns to."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude, side
from fieldsid.numerics.arrays import FloatArray

SIDE, SENSE, LEFT = 0, 1, 2
"""Columns of the memory: side of the fin, which way a positive fin turns (0 not known yet), reversals left."""


def _memory(p: Parameters) -> tuple[float, ...]:
    return (side(p), 0.0, p["reversals"])


def _rule(p: Parameters, time: float, angle: FloatArray, rate: FloatArray, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
    out = memory.copy()
    # The first crossing tells which way the fin turns the vehicle: the sign of the authority need not be known.
    crossed = np.abs(angle) >= p["turn"]
    first = crossed & (out[:, SENSE] == 0)
    out[first, SENSE] = np.sign(angle[first]) * out[first, SIDE]
    passed = crossed & (angle * out[:, SENSE] * out[:, SIDE] > 0)
    out[passed, SIDE] *= -1.0
    out[passed, LEFT] -= 1.0
    over = (out[:, LEFT] < 0) | (time >= p["duration"])
    return np.where(over, np.nan, p["amplitude"] * out[:, SIDE]), out


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
    memory=_memory,
    source="ITTC 7.5-04-02-01, zig-zag test; IMO MSC.137(76)",
)
