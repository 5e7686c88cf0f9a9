"""The fin works better to one side: delta = command (1 + asymmetry) for command > 0, command (1 - asymmetry) below.

A bent stock, a damaged blade or the wake of another body does this; a positive asymmetry makes the positive side the stronger.
In its variant the difference grows gradually with the angle: lift_bend command^2 is added.
Source: Bertram 2012, Practical Ship Hydrodynamics, chapter 6.
"""

from __future__ import annotations

from fieldsid.effects._static_map import StaticMap
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values, Variant
from fieldsid.models.fin_path import FinPath
from fieldsid.models.record import Record


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path with different gains on the two sides, (n-1,) rad."""
    more, bend = values["asymmetry"], values.get("lift_bend", 0.0)
    if more == 0.0 and bend == 0.0:
        return path
    return StaticMap(proportional=1.0, one_sided=more, square=bend).through(path, record.steps)


EFFECT = Effect(
    name="asymmetric_fin",
    says="the fin works better to one side than to the other",
    stage=Stage.ACTUATOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="delta = command * (1 + asymmetry * sign(command))",
    coefficients=(Coefficient("asymmetry", "1", -0.9, 0.9, 0.05, says="gain to the positive side over the mean gain, less one"),),
    telltale="turns to one side are stronger than simulated and weaker to the other, in proportion to the command",
    excited_by=("square_pulses", "doublet", "zigzag", "turning_circle", "stairs"),
    mistaken_for=("stall", "backlash", "gyro_bias", "prop_moment", "deadband"),
    source="Bertram 2012, Practical Ship Hydrodynamics, chapter 6",
    order=60,
    fin=fin,
    variants=(
        Variant(
            "the two sides part gradually",
            (Coefficient("lift_bend", "1/rad", -5.0, 5.0, 0.0, says="gain of the one side over the other, per rad of fin"),),
        ),
    ),
)
