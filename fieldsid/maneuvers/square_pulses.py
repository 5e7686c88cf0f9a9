"""Two pairs of square pulses with a closed-loop recovery between them: the rapid experiment of the paper."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude, levels
from fieldsid.numerics.arrays import FloatArray


def _command(p: Parameters, time: FloatArray) -> FloatArray:
    first, second, width = p["amplitude"], p["second"], p["width"]
    widths = np.array([width, width, p["recovery"], width, width])
    return levels(time, widths, np.array([first, -first, np.nan, second, -second]))


MANEUVER = Maneuver(
    name="square_pulses",
    says="a large pair of opposite pulses, recovery by the autopilot, a smaller pair",
    parameters=(
        amplitude(0.26, "fin angle of the first pair"),
        Parameter("second", "rad", 0.001, 0.7, 0.15, "fin angle of the second pair"),
        Parameter("width", "s", 0.2, 20.0, 2.0, "length of each pulse"),
        Parameter("recovery", "s", 0.0, 60.0, 13.0, "autopilot between the pairs"),
    ),
    duration=lambda p: 4.0 * p["width"] + p["recovery"],
    command=_command,
    source="rapid on-board identification of the STARFISH AUV, section on experiments",
)
