"""The righting moment at large pitch: the stiffness follows sin(theta), and a part of the trim follows cos(theta).

    q' += righting_sin (theta - sin theta) + righting_cos (cos theta - 1)
righting_sin in 1/s^2 (the part of c23 that is weight times metacentric height, positive when stable), righting_cos in
rad/s^2 (weight fore or aft of the buoyancy). Source: Fossen 2011, section 4.1 (hydrostatics of submerged vehicles).
"""

from __future__ import annotations

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values
from fieldsid.models.hull import Core


def core(values: Values, scale: float) -> Core:
    """Return the core's constants; hydrostatics do not depend on the speed."""
    return Core(righting_sin=values["righting_sin"], righting_cos=values["righting_cos"])


EFFECT = Effect(
    name="large_angle_righting",
    says="at large pitch the righting moment falls behind its straight line",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.PITCH,),
    equation="q' += righting_sin * (theta - sin(theta)) + righting_cos * (cos(theta) - 1)",
    coefficients=(
        Coefficient("righting_sin", "1/s^2", -20.0, 20.0, 0.05, says="stiffness that follows the sine of the pitch"),
        Coefficient("righting_cos", "rad/s^2", -20.0, 20.0, 0.01, says="trim moment that follows the cosine of the pitch"),
    ),
    telltale="the simulated pitch is too small at large angles and right near level",
    excited_by=("square_pulses", "stairs", "chirp"),
    mistaken_for=("heave_coupling", "stall", "quadratic_damping", "depth_buoyancy"),
    source="Fossen 2011, section 4.1",
    core=core,
)
