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
    """Return the motion as the compass shows it: a changed angle (n,) rad, the same rate."""
    sin, cos = np.sin(motion.angle), np.cos(motion.angle)
    shown = motion.angle + values["deviation_sin"] * sin + values["deviation_cos"] * cos
    if "deviation_sin2" in values:
        shown += 2.0 * values["deviation_sin2"] * sin * cos + values["deviation_cos2"] * (cos - sin) * (cos + sin)
    return Motion(shown, motion.rate)


def sensor_jvp(moves: FloatArray, motion: Motion, values: Values, record: Record) -> FloatArray:
    """Return small changes of the motion (P, 2, n) as the compass shows them."""
    sin, cos = np.sin(motion.angle), np.cos(motion.angle)
    slope = 1.0 + values["deviation_sin"] * cos - values["deviation_cos"] * sin
    if "deviation_sin2" in values:
        slope += 2.0 * values["deviation_sin2"] * (cos - sin) * (cos + sin) - 4.0 * values["deviation_cos2"] * sin * cos
    carried = moves.copy()
    carried[:, 0] *= slope
    return carried


def sensor_slope(name: str, motion: Motion, values: Values, record: Record) -> FloatArray:
    """Return the derivative (2, n) of the measured motion by a coefficient."""
    slope, times = np.zeros((2, motion.angle.size)), 2.0 if name.endswith("2") else 1.0
    (np.sin if name.startswith("deviation_sin") else np.cos)(times * motion.angle, out=slope[0])
    return slope


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
    sensor_slope=sensor_slope,
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
