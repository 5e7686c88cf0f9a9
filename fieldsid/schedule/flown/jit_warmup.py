"""The compile warm-up of turning and closed-loop kernels, which a tour runs in a worker process; see fitting/jit_warmup.py."""

from __future__ import annotations

import numpy as np

from fieldsid.dynamics.steady_kernel import settled_rates, straight_slopes
from fieldsid.models.hull import CONSTANTS
from fieldsid.schedule.flown.closed_loop_kernel import GAINS, MOTION, Dive, Plants, close_loop
from fieldsid.schedule.flown.response import STEP_S
from fieldsid.turning.maneuvering.equations import NAMES, about_straight, settle, simulate
from fieldsid.turning.steady.speed_loss import simulated


def compile_loops() -> None:
    """Call each kernel of turns, gain design and verification once, on vehicles whose coefficients are all one."""
    none, push, out = np.zeros((1, len(GAINS))), np.zeros(2), np.zeros((1, 2, len(MOTION)))
    p, time = np.ones(len(NAMES)), np.array([0.0, STEP_S])
    time.setflags(write=False)  # like that of a run
    simulate(p, 1.0, np.ones((1, 3)), np.zeros(1, dtype=np.int64), time, np.zeros((1, 2)), np.ones(2), STEP_S)
    settle(p, 1.0, 0.0)
    simulated(push[1:], push, push, push, 1.0)
    about_straight(p[None], 1.0)
    row, rows = np.zeros(1), np.zeros((1, len(CONSTANTS)))
    plants = Plants(**{name: rows if name.startswith("core") else row for name in Plants._fields})
    straight_slopes(rows)
    settled_rates(rows, row, row, row, 1.0, np.zeros(0), np.zeros((1, 0)), np.zeros(1))
    close_loop(plants, p[None], none, 0.0, Dive(0.0, 0.0, 0.0, 0.0), 1.0, STEP_S, push, out)
