"""A chirp: a sine whose frequency grows from low to high, evenly per octave."""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude
from fieldsid.numerics.arrays import FloatArray


def _command(p: Parameters, time: FloatArray) -> FloatArray:
    low, high, length = p["low_hz"], p["high_hz"], p["duration"]
    growth = np.log(max(high, low * 1.001) / low) / length
    inside = np.clip(time, 0.0, length)
    phase = 2.0 * np.pi * low * (np.exp(growth * inside) - 1.0) / growth
    fin = p["amplitude"] * np.sin(phase)
    return np.where(time < 0, 0.0, np.where(time < length - 1e-9, fin, np.nan))


MANEUVER = Maneuver(
    name="chirp",
    says="a sine that speeds up, evenly per octave: shows the fin's delay and lag as well as the hull",
    parameters=(
        amplitude(0.2),
        Parameter("low_hz", "Hz", 0.005, 5.0, 0.05, "frequency at the start"),
        Parameter("high_hz", "Hz", 0.01, 10.0, 1.0, "frequency at the end"),
        Parameter("duration", "s", 2.0, 600.0, 30.0, "length", tuned=False),
    ),
    duration=lambda p: p["duration"],
    command=_command,
    source="Farina 2000, logarithmic sweep; Tischler and Remple 2012, section 5.5",
)
