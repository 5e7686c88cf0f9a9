"""The rate gyro has an offset: rate_measured = rate + bias, rad/s; the angle is right.

In its variant the offset drifts as the gyro warms up: rate_measured = rate + bias + bias_drift t, t in minutes from the first
sample. The bias can be estimated only where the angle is measured as well as the rate, or where the trim is known. Source: Fossen
2011, chapter 11 (strapdown sensors); Groves 2013, chapter 4.
"""

from __future__ import annotations

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Motion, Stage, Values, Variant
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

MINUTE_S = 60.0


def measure(motion: Motion, values: Values, record: Record) -> Motion:
    """Return the motion as the gyro shows it: the same angle, a changed rate (n,) rad/s."""
    if "bias_drift" not in values:
        return Motion(motion.angle, motion.rate + values["bias"])
    minutes = (record.time - record.time[0]) / MINUTE_S
    return Motion(motion.angle, motion.rate + values["bias"] + values["bias_drift"] * minutes)


def sensor_jvp(moves: FloatArray, motion: Motion, values: Values, record: Record) -> FloatArray:
    """Return small changes of the motion (P, 2, n) as the gyro shows them: an offset does not change them."""
    return moves


EFFECT = Effect(
    name="gyro_bias",
    says="the rate gyro has a constant offset",
    stage=Stage.SENSOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="rate_measured = rate + bias",
    coefficients=(Coefficient("bias", "rad/s", -0.2, 0.2, 0.002, says="offset of the rate gyro"),),
    telltale="the rate residual has a constant mean while the angle residual has none",
    excited_by=("square_pulses", "doublet", "multisine"),
    mistaken_for=("gyro_scale", "asymmetric_fin", "trim_drift"),
    source="Groves 2013, chapter 4",
    measure=measure,
    sensor_jvp=sensor_jvp,
    variants=(
        Variant(
            "it drifts",
            (Coefficient("bias_drift", "rad/s per minute", -0.2, 0.2, 0.0, says="what the offset grows by in a minute"),),
        ),
    ),
)
