"""The compile warm-up of planning; fitting/jit_warmup.py compiles the kernels that a fit needs as well."""

from __future__ import annotations

import numpy as np

from fieldsid.dynamics.linear_kernel import linear_sensitivities
from fieldsid.maneuvers import Autopilot, Limits, Schedule, all_maneuvers, fly
from fieldsid.models.hull import CONSTANTS, DRIVES
from fieldsid.noise.kalman.univariate import kalman_filter
from fieldsid.planning.flight.rule_flight import OperatingPointPlant, closed_loop

SHARED_KERNELS = (linear_sensitivities, kalman_filter)
"""The kernels of a fit that planning calls."""


def compile_planning() -> None:
    """Call each kernel of planning once, on vehicles at rest."""
    # sizes above one, so that the arrays have the memory layout of a real plan
    m, n, zero = 2, 3, np.zeros
    steps = np.full(n - 1, 0.05)
    drive, c = zero((m, n - 1, len(DRIVES))), zero((m, len(CONSTANTS)))
    push, off = zero((m, n - 1, 2)), zero((m, n - 1, 2))
    closed_loop(steps, drive[0].copy(), c[0], 1, zero(n), off[0], push[0], zero(3), zero(4), zero(n), zero((n, 3)))
    plant = OperatingPointPlant(drive, c, 1, push, zero(m), off, zero((m, 3)))
    still, short = Autopilot(0.0, 0.0), Schedule(20.0, 0.0, 0.0)
    for maneuver in all_maneuvers().values():
        if maneuver.rule is not None:
            shortest = {p.name: p.low for p in maneuver.parameters}
            fly(maneuver, shortest, plant.again(off), limits=Limits(0.1), autopilot=still, schedule=short)
