"""The compass errs by heading: measured = psi + deviation_sin sin(psi) + deviation_cos cos(psi), rad.

Magnets in the vehicle do this (semicircular deviation); soft iron adds deviation_sin2 sin(2 psi) + deviation_cos2 cos(2 psi)
(quadrantal deviation). The rate gyro is right, so heading and rate disagree.
Source: Groves 2013, Principles of GNSS, Inertial and Multisensor Integrated Navigation Systems, chapter 6.
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Motion, Stage, Values, Variant
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray


def measure(motion: Motion, values: Values, record: Record) -> Motion:
    """Return the motion as the compass shows it; angle (n,) rad, rate as it is."""
    psi = motion.angle
    shown = psi + values["deviation_sin"] * np.sin(psi) + values["deviation_cos"] * np.cos(psi)
    if "deviation_sin2" in values:
        shown = shown + values["deviation_sin2"] * np.sin(2.0 * psi) + values["deviation_cos2"] * np.cos(2.0 * psi)
    return Motion(shown, motion.rate)


def sensor_jvp(moves: FloatArray, motion: Motion, values: Values, record: Record) -> FloatArray:
    """Return small moves of the motion (P, 2, n) as the compass shows them."""
    psi = motion.angle
    slope = 1.0 + values["deviation_sin"] * np.cos(psi) - values["deviation_cos"] * np.sin(psi)
    if "deviation_sin2" in values:
        slope += 2.0 * (values["deviation_sin2"] * np.cos(2.0 * psi) - values["deviation_cos2"] * np.sin(2.0 * psi))
    return np.asarray(moves * np.stack([slope, np.ones_like(slope)]))


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
    sensor_jvp=sensor_jvp,
    variants=(
        Variant(
            "it goes twice around with the heading as well",
            (
                Coefficient("deviation_sin2", "rad", -0.5, 0.5, 0.0, says="quadrantal error, greatest on north-east"),
                Coefficient("deviation_cos2", "rad", -0.5, 0.5, 0.0, says="quadrantal error, greatest on north"),
            ),
        ),
    ),
)
