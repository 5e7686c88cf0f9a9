"""The compass errs by heading: measured = psi + deviation_sin sin(psi) + deviation_cos cos(psi), rad.

Iron in the vehicle does this (semicircular deviation). The rate gyro is right, so heading and rate disagree.
Source: Groves 2013, Principles of GNSS, Inertial and Multisensor Integrated Navigation Systems, chapter 6.
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Motion, Stage, Values
from fieldsid.models.record import Record


def measure(motion: Motion, values: Values, record: Record) -> Motion:
    """Return the motion as the compass shows it; angle (n,) rad, rate as it is."""
    psi = motion.angle
    return Motion(psi + values["deviation_sin"] * np.sin(psi) + values["deviation_cos"] * np.cos(psi), motion.rate)


EFFECT = Effect(
    name="compass_deviation",
    says="the compass errs by an amount that goes once around with the heading",
    stage=Stage.SENSOR,
    axes=(Axis.YAW,),
    equation="psi_measured = psi + deviation_sin * sin(psi) + deviation_cos * cos(psi)",
    coefficients=(
        Coefficient("deviation_sin", "rad", -0.5, 0.5, 0.01, says="error on a heading of east"),
        Coefficient("deviation_cos", "rad", -0.5, 0.5, 0.01, says="error on a heading of north"),
    ),
    telltale="the heading residual repeats with the heading while the rate residual is white",
    excited_by=("turning_circle", "zigzag"),
    mistaken_for=("current", "gyro_scale", "gyro_bias"),
    source="Groves 2013, chapter 6",
    measure=measure,
)
