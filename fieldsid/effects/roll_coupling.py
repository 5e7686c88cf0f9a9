"""A rolled hull yaws: r' += roll_moment phi, roll angle phi in rad (positive starboard down), roll_moment in 1/s^2.

When the hull is rolled, the elevators and the offset of weight from buoyancy have a component in the yaw plane. In its variants
the roll rate adds a moment roll_rate_moment phi', or the cube of the roll angle a moment roll_cubic phi^3.
Source: Fossen 2011, section 7.5 (6-DOF underwater vehicle, coupled terms linearised in phi).
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values, Variant
from fieldsid.models.record import Record


def terms(values: Values, record: Record) -> Terms:
    """Return the moment of the roll angle, (n,) rad/s^2."""
    roll = record["roll"]
    moment = values["roll_moment"] * roll
    if "roll_rate_moment" in values:
        moment = moment + values["roll_rate_moment"] * np.gradient(roll, record.time)
    if "roll_cubic" in values:
        moment = moment + values["roll_cubic"] * (roll * roll * roll)  # a power takes ten times as long as the products
    return Terms(moment=moment)


EFFECT = Effect(
    name="roll_coupling",
    says="a rolled hull yaws, by its elevators and its weight",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW,),
    equation="r' += roll_moment * phi",
    coefficients=(Coefficient("roll_moment", "1/s^2", -20.0, 20.0, 0.05, says="yaw moment per rad of roll"),),
    telltale="the residual rate moves with the roll angle, with the fin still as well",
    excited_by=("zigzag", "turning_circle", "square_pulses"),
    mistaken_for=("wave", "sway_coupling", "asymmetric_fin", "step_change"),
    source="Fossen 2011, section 7.5",
    needs=("roll",),
    terms=terms,
    variants=(
        Variant(
            "the roll rate has a part of its own",
            (Coefficient("roll_rate_moment", "1/s", -20.0, 20.0, 0.0, says="yaw moment per rad/s of roll rate"),),
        ),
        Variant(
            "it bends with the angle of roll",
            (Coefficient("roll_cubic", "1/s^2", -1e4, 1e4, 0.0, says="yaw moment per cube of the roll in rad"),),
        ),
    ),
)
