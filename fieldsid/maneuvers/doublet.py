"""A doublet: one pulse to each side, repeated with a pause."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude, levels
from fieldsid.numerics.arrays import FloatArray


def _command(p: Parameters, time: FloatArray) -> FloatArray:
    count = round(p["repeats"])
    widths = np.tile([p["width"], p["width"], p["pause"]], count)[:-1]
    fins = np.tile([p["amplitude"], -p["amplitude"], 0.0], count)[:-1]
    return levels(time, widths, fins)


MANEUVER = Maneuver(
    name="doublet",
    says="one pulse to each side: short, small excursion, energy around 1/(2 width)",
    parameters=(
        amplitude(0.26),
        Parameter("width", "s", 0.2, 20.0, 2.0, "length of each pulse"),
        Parameter("pause", "s", 0.0, 30.0, 2.0, "fin at trim between two doublets"),
        Parameter("repeats", "", 1, 10, 2, "number of doublets", whole=True),
    ),
    duration=lambda p: (2.0 * p["width"] + p["pause"]) * p["repeats"] - p["pause"],
    command=_command,
    source="Klein and Morelli 2006, Aircraft System Identification, chapter 9",
)
