"""The trim moment drifts: moment = drift (t - t_first) / 60, drift in rad/s^2 per minute, t_first the run's first sample.

Flooding, a shifting battery or a cooling servo causes it; the trim parameter is that at the start of the run. A positive drift
turns toward positive angle. In one variant it levels off, drift (1 - exp(-levelling t)) / levelling, or accelerates where
levelling is negative. In the other it is proportional to a power of the speed, drift u^drift_power: a fin whose zero drifts has a
moment in proportion to u^2, a weight that shifts has not.
Source: Fossen 2011, sections 4.1 (restoring moment of a moving centre of gravity) and 6.4 (lift against u^2).
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values, Variant
from fieldsid.models.record import Record

MINUTE_S = 60.0
MIN_LEVELLING_RATE_1_S = 1e-6
"""Absolute value of `levelling` in 1/s below which the drift is computed as linear."""


def terms(values: Values, record: Record) -> Terms:
    """Return the drifting moment, (n,) rad/s^2."""
    since, rate = record.time - record.time[0], values.get("levelling", 0.0)
    grown = since if abs(rate) <= MIN_LEVELLING_RATE_1_S else -np.expm1(-rate * since) / rate
    moment = values["drift"] * grown / MINUTE_S
    if "drift_power" in values:
        moment = moment * np.maximum(record["surge"], 0.0) ** values["drift_power"]
    return Terms(moment=moment)


EFFECT = Effect(
    name="trim_drift",
    says="the trim moment drifts steadily through the run",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="moment = drift * (t - t_first) / 60",
    coefficients=(Coefficient("drift", "rad/s^2 per min", -2.0, 2.0, 0.01, says="change of the trim moment per minute"),),
    telltale="the residual rate leans: early and late parts of every run err to opposite sides, whatever the fin does",
    excited_by=("square_pulses", "multisine", "zigzag"),
    mistaken_for=("step_change", "speed_moment", "depth_buoyancy", "prop_moment", "gyro_bias", "wave"),
    source="Fossen 2011, section 4.1",
    terms=terms,
    variants=(
        Variant(
            "it levels off, or gathers pace",
            (
                Coefficient(
                    "levelling",
                    "1/s",
                    -0.1,
                    0.5,
                    0.03,
                    scan=(-0.02, 0.015, 0.05),
                    step=1e-3,
                    says="rate at which the drift dies out",
                ),
            ),
        ),
        Variant(
            "it is the fin's, and goes with a power of the speed",
            (Coefficient("drift_power", "1", 0.0, 4.0, 2.0, step=1e-3, says="power of the speed it goes with"),),
            needs=("surge",),
        ),
    ),
)
