"""A turning circle: the fin is constant until the heading has changed by a set angle, then amidships for the pull-out."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, amplitude
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def _rule(values: FloatArray, time: float, angle: FloatArray, rate: FloatArray, memory: FloatArray, fin: FloatArray) -> None:
    """Fill the fins (m,); memory (m, 1) is the time at which the pull-out began."""
    most, turn, pull_out, mirrored, duration = values[0], values[1], values[2], values[3], values[4]
    limit = turn if time < duration - pull_out else 0.0
    for i in range(fin.shape[0]):
        if abs(angle[i]) >= limit:
            memory[i, 0] = min(memory[i, 0], time)
        if time >= memory[i, 0] + pull_out:
            fin[i] = np.nan
        else:
            fin[i] = most * (1.0 - 2.0 * mirrored) if time < memory[i, 0] else 0.0


MANEUVER = Maneuver(
    name="turning_circle",
    says="a full circle at constant fin, then fin amidships: steady turning, speed lost in it, straight-line stability",
    parameters=(
        amplitude(0.26),
        Parameter("turn", "rad", 0.2, 25.2, 9.42477796076938, "heading to turn through, 3 pi is one and a half circles"),
        Parameter("pull_out", "s", 0.0, 60.0, 8.0, "fin amidships after the circle"),
        Parameter("mirrored", "", 0, 1, 0, "1 starts to the other side", whole=True, tuned=False),
        Parameter("duration", "s", 2.0, 900.0, 120.0, "ends here even if the circle is not complete", tuned=False),
    ),
    duration=lambda p: p["duration"],
    rule=_rule,
    memory=lambda _: (np.inf,),
    source="ITTC 7.5-04-02-01, turning circle and pull-out tests",
)
