"""Drag of the turning hull grows with the square of the rate: p' += -quadratic p |p|, quadratic >= 0 in 1/rad.

The same at every speed, as drag by the hull's own turning has no u in it. Source: Fossen 2011, section 6.4 (N_|r|r).
"""

from __future__ import annotations

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Core, Effect, Stage, Values


def core(values: Values, scale: float) -> Core:
    """Return the core's coefficients; speed has no part in them."""
    return Core(quadratic=values["quadratic"])


EFFECT = Effect(
    name="quadratic_damping",
    says="drag of the turning hull grows with the square of the turn rate",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="p' += -quadratic * p * |p| (p: the rate)",
    coefficients=(Coefficient("quadratic", "1/rad", 0.0, 50.0, 0.1, scan=(0.1, 1.0, 5.0), says="damping per rad/s of rate"),),
    telltale="the simulated rate is too high in hard turns and too low in gentle ones",
    excited_by=("zigzag", "turning_circle", "stairs", "multisine"),
    mistaken_for=("stall", "crossflow_drag", "speed_varying", "deadband", "sway_coupling", "heave_coupling"),
    source="Fossen 2011, section 6.4",
    core=core,
)
