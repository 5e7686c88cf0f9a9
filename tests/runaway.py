"""Logs whose equations ask for a vehicle that runs away: a pitch rate of the wrong sign, over minutes."""

from __future__ import annotations

import numpy as np
from cli import trial

from fieldsid.dynamics.free_run import command_record, simulate
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis

SECONDS, SAMPLE, SPEED = 250.0, 0.05, 1.4


def flown(name="runaway", *, seconds=SECONDS, sign=-1.0, seed=1, **values):
    """A run of pulses of the elevator, its pitch rate logged with a sign; values are the vehicle's own."""
    time = np.arange(0.0, seconds, SAMPLE)
    fin = np.where((time > 1.5) & (time % 20.0 < 4.0), np.where(time % 20.0 < 2.0, 0.2, -0.2), 0.0)
    shown = simulate(trial.vehicle(Axis.PITCH, **values), command_record(Axis.PITCH, time, fin, speed=SPEED))
    rng = np.random.default_rng(seed)
    angle, rate = (v + 0.003 * rng.standard_normal(time.size) for v in (shown.angle, shown.rate))
    signals = {"pitch_rad": angle, "pitch_rate_rad_s": sign * rate, "elevator_rad": fin, "surge_m_s": np.full(time.size, SPEED)}
    return Run(name, time, signals)
