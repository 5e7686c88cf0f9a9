"""The paper's identified vehicles (tables 2 and 3) as truth, flown as in its experiment: pulses and recovery, 33 s at 20 Hz."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

DEG = np.pi / 180.0


class YawRow(NamedTuple):
    """One row of table 2."""

    speed: float
    a22: float
    b2: float
    C0: float


class PitchRow(NamedTuple):
    """One row of table 3."""

    speed: float
    c22: float
    c23: float
    d2: float
    Cb: float
    theta0_deg: float


YAW = (
    YawRow(1.07, 1.04, -0.62, -0.0086), YawRow(1.36, 1.11, -0.86, -0.0082), YawRow(1.63, 1.01, -1.04, -0.0081),
    YawRow(1.92, 1.08, -1.41, -0.0042), YawRow(2.19, 1.10, -1.83, -0.0021),
)  # fmt: skip
PITCH = (
    PitchRow(1.09, 2.13, 0.052, 0.94, -0.089, -2.72), PitchRow(1.37, 2.34, 0.057, 1.34, -0.100, -1.53),
    PitchRow(1.67, 2.31, 0.031, 1.58, -0.081, -0.94), PitchRow(1.93, 2.43, 0.021, 1.91, -0.102, -0.40),
    PitchRow(2.23, 2.57, 0.033, 2.39, -0.099, -0.06),
)  # fmt: skip


def physics_of(row: YawRow | PitchRow) -> Physics:
    """Return the physics of a row, with a pilot who cancels its trim."""
    if isinstance(row, YawRow):
        base = Physics(damping=row.a22, authority=row.b2, trim=row.C0, nominal_speed=row.speed)
        return base._replace(kp=0.8 / abs(row.b2), kd=0.4 / abs(row.b2), fin_trim=-row.C0 / row.b2)
    base = Physics(damping=row.c22, stiffness=row.c23, authority=row.d2, trim=row.Cb, nominal_speed=row.speed)
    trim = (row.c23 * row.theta0_deg * DEG - row.Cb) / row.d2
    return base._replace(kp=1.2 / row.d2, kd=0.4 / row.d2, fin_trim=trim)


def paper_run(row: YawRow | PitchRow, *, angle_noise=0.0, rate_noise=0.0, seed=0, rate_hz=20.0, duration=33.0):
    """Return a log (canonical columns) of the paper's experiment with a row of its tables; white noise in rad and rad/s."""
    pitching, clock = isinstance(row, PitchRow), Clock(1.0 / rate_hz, round(duration * rate_hz))
    plan = maneuvers.pulses(clock.time, 0.26, 0.15, start=2.0, recovery=9.0)
    start = row.theta0_deg * DEG if pitching else 0.0
    noise = {"angle_noise": angle_noise, "rate_noise": rate_noise, "seed": seed}
    return flown(physics_of(row), clock, plan, pitching=pitching, angle=start, **noise)
