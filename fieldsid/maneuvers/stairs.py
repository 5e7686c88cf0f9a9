"""Amplitude stairs: the same pair of pulses at growing fin angle, to excite what is not proportional to it."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude, levels
from fieldsid.numerics.arrays import FloatArray


def _command(p: Parameters, time: FloatArray) -> FloatArray:
    count = round(p["steps"])
    lowest = min(p["lowest"], p["amplitude"])
    heights = np.linspace(lowest, p["amplitude"], count) if count > 1 else np.array([p["amplitude"]])
    fins = np.repeat(heights, 2) * np.tile([1.0, -1.0], count)
    return levels(time, np.full(2 * count, p["hold"]), fins)


MANEUVER = Maneuver(
    name="stairs",
    says="pairs of pulses at growing fin angle: deadband shows in the first, stall and rate limit in the last",
    parameters=(
        amplitude(0.4),
        Parameter("lowest", "rad", 0.001, 0.5, 0.03, "fin angle of the first pair"),
        Parameter("steps", "", 1, 12, 5, "number of pairs", whole=True),
        Parameter("hold", "s", 0.5, 20.0, 2.5, "length of each pulse"),
    ),
    duration=lambda p: 2.0 * p["hold"] * p["steps"],
    command=_command,
    source="Isermann and Muenchhof 2011, section 6.3 (amplitude-modulated binary signals)",
)
