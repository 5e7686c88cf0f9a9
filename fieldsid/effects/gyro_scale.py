"""The rate gyro has a wrong scale: rate_measured = (1 + scale_error) rate; the angle is right.

In its variants the error grows with the rate, rate_measured = (1 + scale_error + scale_cubic rate^2) rate, or differs
from side to side, rate_measured = (1 + scale_error) rate + scale_side |rate|.
Source: Groves 2013, Principles of GNSS, Inertial and Multisensor Integrated Navigation Systems, chapter 4 (scale factor
error, nonlinearity and asymmetry).
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Motion, Stage, Values, Variant
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray


def measure(motion: Motion, values: Values, record: Record) -> Motion:
    """Return the motion as the gyro shows it: the same angle, a changed rate (n,) rad/s."""
    cubic, side = values.get("scale_cubic", 0.0) * motion.rate**2, values.get("scale_side", 0.0) * np.abs(motion.rate)
    return Motion(motion.angle, motion.rate * (1.0 + values["scale_error"] + cubic) + side)


def sensor_jvp(moves: FloatArray, motion: Motion, values: Values, record: Record) -> FloatArray:
    """Return small changes of the motion (P, 2, n) as the gyro shows them."""
    slope = 1.0 + values["scale_error"] + 3.0 * values.get("scale_cubic", 0.0) * motion.rate**2
    slope += values.get("scale_side", 0.0) * np.sign(motion.rate)
    return np.asarray(moves * np.stack([np.ones(slope.size), slope]))


EFFECT = Effect(
    name="gyro_scale",
    says="the rate gyro shows too much or too little by a constant share",
    stage=Stage.SENSOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="rate_measured = (1 + scale_error) * rate",
    coefficients=(Coefficient("scale_error", "1", -0.5, 0.5, 0.02, says="share by which the gyro shows too much"),),
    telltale="the rate residual is in proportion to the rate while the angle residual is not in proportion to the angle",
    excited_by=("zigzag", "turning_circle", "square_pulses", "multisine"),
    mistaken_for=("gyro_bias", "compass_deviation", "speed_varying"),
    source="Groves 2013, chapter 4",
    measure=measure,
    sensor_jvp=sensor_jvp,
    variants=(
        Variant(
            "the error grows with the rate",
            (Coefficient("scale_cubic", "s^2/rad^2", -1e4, 1e4, 0.0, says="share of error per square of the rate"),),
        ),
        Variant(
            "the error differs from side to side",
            (Coefficient("scale_side", "1", -0.5, 0.5, 0.0, says="half the difference of the two sides' scales"),),
        ),
    ),
)
