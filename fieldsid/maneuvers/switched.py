"""A binary signal: the fin alternates between two opposite angles; the planner optimises its switching times.

For a linear model the input of largest information under an amplitude limit is at the limit almost everywhere, so that only the
switching times are free (Goodwin and Payne 1977, chapter 6).
"""

from __future__ import annotations

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude, levels, side
from fieldsid.numerics.arrays import FloatArray

COUNT = 16
HOLDS = tuple(f"t{i}" for i in range(1, COUNT + 1))


def _widths(p: Parameters) -> FloatArray:
    return np.array([p[name] for name in HOLDS])


def _command(p: Parameters, time: FloatArray) -> FloatArray:
    signs = np.where(np.arange(COUNT) % 2 == 0, 1.0, -1.0)
    return levels(time, _widths(p), p["amplitude"] * side(p) * signs)


MANEUVER = Maneuver(
    name="switched",
    says="the fin jumps between two opposite angles, each held for its own time",
    parameters=(
        amplitude(0.26),
        *(Parameter(name, "s", 0.0, 60.0, 1.5 if i < 6 else 0.0, f"length of hold {i + 1}") for i, name in enumerate(HOLDS)),
        Parameter("mirrored", "", 0, 1, 0, "1 starts to the other side", whole=True, tuned=False),
    ),
    duration=lambda p: float(_widths(p).sum()),
    command=_command,
    source="Goodwin and Payne 1977, Dynamic System Identification, chapter 6",
)
