"""What planning compiles for itself the first time on a machine; the rest is compiled beside it, see fitting/ahead.py."""

from __future__ import annotations

import numpy as np

from fieldsid.fitting.kalman_sea import sea
from fieldsid.models import kernels
from fieldsid.models.linear_core import linear_tangents
from fieldsid.planning.loop import closed_loop
from fieldsid.planning.rule_flight import ScenePlant

BESIDE = (linear_tangents, sea)
"""What planning calls of what every fit needs."""
SCENES, SAMPLES = 2, 3
"""More than one of each, so that what is handed over lies in memory as it does when planning."""


def compile_plans() -> None:
    """Call once, on vehicles that do not move, what planning calls thousands of times."""
    m, n, steps, zero = SCENES, SAMPLES, np.full(SAMPLES - 1, 0.05), np.zeros
    drive, c = zero((m, n - 1, len(kernels.DRIVES))), zero((m, len(kernels.CONSTANTS)))
    push, off = zero((m, n - 1, 3)), zero((m, n - 1, 2))
    closed_loop(steps, drive[0].copy(), c[0], 1, zero(n), off[0], push[0], zero(3), zero(4), zero(n), zero((n, 3)))
    ScenePlant(drive, c, 1, push, zero(m), off, zero((m, 3))).advance(zero(m), 0.05)
