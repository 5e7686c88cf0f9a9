"""A regular wave shakes the hull: moment = amplitude sin(2 pi (t - t_first) / period + phase).

period (s) and amplitude (rad/s^2, >= 0) are those of the sea state, phase (rad) is each run's own.
Source: Fossen 2011, section 8.2 (first-order wave moment of one component).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values
from fieldsid.models.record import Record

SHORTEST_S, LONGEST_S, TRIED, KEPT = 1.0, 30.0, 60, 2


def terms(values: Values, record: Record) -> Terms:
    """Return the wave's moment, (n,) rad/s^2."""
    angle = 2.0 * math.pi * (record.time - record.time[0]) / values["period"] + values["phase"]
    return Terms(moment=values["amplitude"] * np.sin(angle))


def suggest(records: Sequence[Record], residuals: Sequence[FloatArray]) -> list[dict[str, float]]:
    """Return the periods at which the rate residual of all runs together swings most (Lomb-Scargle by projection)."""
    periods = np.geomspace(SHORTEST_S, LONGEST_S, TRIED)
    power = np.zeros(periods.size)
    for record, residual in zip(records, residuals, strict=True):
        channel, ok = (1, record.rate_ok) if record.rate_ok.any() else (0, record.angle_ok)
        time, e = record.time[ok] - record.time[0], residual[channel][ok]
        turn = 2.0 * math.pi * time / periods[:, None]
        e = e - e.mean()
        power += (np.sin(turn) @ e) ** 2 / e.size + (np.cos(turn) @ e) ** 2 / e.size
    peaks = [i for i in range(periods.size) if power[i] == power[max(0, i - 3) : i + 4].max()]
    best = sorted(peaks, key=lambda i: -power[i])[:KEPT]
    return [{"period": float(periods[i]), "amplitude": 0.02} for i in best]


EFFECT = Effect(
    name="wave",
    says="a regular wave shakes the hull at one period",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="moment = amplitude * sin(2 pi * (t - t_first) / period + phase)",
    coefficients=(
        Coefficient(
            "period",
            "s",
            1.0,
            30.0,
            6.0,
            step=1e-3,
            says="period at which the hull meets the wave",
        ),
        Coefficient("amplitude", "rad/s^2", 0.0, 2.0, 0.02, says="largest moment of the wave"),
        Coefficient(
            "phase",
            "rad",
            -math.pi,
            math.pi,
            0.0,
            scan=(-0.75 * math.pi, -0.25 * math.pi, 0.25 * math.pi, 0.75 * math.pi),
            step=1e-3,
            per_run=True,
            says="phase at the run's first sample",
        ),
    ),
    telltale="the residual swings at one period in every part of the run, with the fin still as well",
    excited_by=("square_pulses", "doublet", "multisine"),
    mistaken_for=("trim_drift", "roll_coupling", "depth_buoyancy", "step_change"),
    source="Fossen 2011, section 8.2",
    terms=terms,
    suggest=suggest,
)
