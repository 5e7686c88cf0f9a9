"""A turning circle: the fin is held until the heading has turned far enough, then put amidships for the pull-out."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude, side
from fieldsid.numerics.arrays import FloatArray


def _memory(_: Parameters) -> tuple[float, ...]:
    return (np.inf,)  # the time at which the pull-out began


def _rule(p: Parameters, time: float, angle: FloatArray, rate: FloatArray, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
    limit = p["turn"] if time < p["duration"] - p["pull_out"] else 0.0
    began = np.minimum(memory[:, 0], np.where(np.abs(angle) >= limit, time, np.inf))
    fin = np.where(time < began, p["amplitude"] * side(p), 0.0)
    return np.where(time >= began + p["pull_out"], np.nan, fin), began[:, None]


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
    memory=_memory,
    source="ITTC 7.5-04-02-01, turning circle and pull-out tests",
)
