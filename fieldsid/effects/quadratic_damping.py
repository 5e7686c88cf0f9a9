"""Drag of the turning hull grows with the square of the rate: p' += -quadratic p |p|, quadratic >= 0 in 1/rad.

It does not depend on the speed u, because the flow of this drag comes from the rotation. Source: Fossen 2011, section 6.4
(N_|r|r). In its variant the power is a coefficient: -quadratic p |p| (|p| / 0.2 rad/s)^(rate_power - 2), so that `quadratic`
keeps its unit.
"""

from __future__ import annotations

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values, Variant
from fieldsid.models.hull import Core

SQUARE = 2.0
POWER = Coefficient(
    "rate_power", "1", 1.2, 4.0, SQUARE, scan=(1.6, 2.6), step=1e-3, says="power of the rate it goes with; all alike at 0.2 rad/s"
)


def core(values: Values, scale: float) -> Core:
    """Return the core's constants; they do not depend on the speed."""
    return Core(quadratic=values["quadratic"], beyond_square=values.get("rate_power", SQUARE) - SQUARE)


EFFECT = Effect(
    name="quadratic_damping",
    says="drag of the turning hull grows with the square of the turn rate",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="p' += -quadratic * p * |p| (p: the rate)",
    coefficients=(Coefficient("quadratic", "1/rad", 0.0, 500.0, 0.1, scan=(0.1, 1.0, 5.0), says="damping per rad/s of rate"),),
    telltale="the simulated rate is too high in hard turns and too low in gentle ones",
    excited_by=("zigzag", "turning_circle", "stairs", "multisine"),
    mistaken_for=("stall", "crossflow_drag", "speed_varying", "deadband", "sway_coupling", "heave_coupling"),
    source="Fossen 2011, section 6.4",
    variants=(Variant("its drag goes with another power of the rate than the square", (POWER,)),),
    core=core,
)
