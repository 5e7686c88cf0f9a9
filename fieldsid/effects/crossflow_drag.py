"""Drag of the cross flow summed along the hull, from the measured sway (yaw) or heave (pitch) speed.

    p' += -crossflow F(v / length, p),   F(a, p) = 32 int_{-1/2}^{1/2} (a + x p) |a + x p| x dx
so that F(0, p) = p |p|: without drift it is quadratic damping. crossflow >= 0 in 1/rad, length of the hull in m.
Source: Fossen 2011, section 6.4.3 (cross-flow drag principle), uniform section drag.
"""

from __future__ import annotations

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Core, Effect, Stage, Values


def core(values: Values, scale: float) -> Core:
    """Return the core's coefficients; speed has no part in them."""
    return Core(crossflow=values["crossflow"], length=values["length"])


EFFECT = Effect(
    name="crossflow_drag",
    says="drag of the cross flow, summed along the hull, when it turns and drifts at once",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="p' += -crossflow * 32 * integral of (v/length + x p)|v/length + x p| x dx over x = -1/2 .. 1/2",
    coefficients=(
        Coefficient("crossflow", "1/rad", 0.0, 500.0, 0.1, scan=(0.1, 1.0, 5.0), says="damping per rad/s of rate without drift"),
        Coefficient("length", "m", 0.3, 10.0, 2.0, scan=(0.8, 2.0, 5.0), step=1e-3, says="length of hull in the cross flow"),
    ),
    telltale="too much rate is simulated in hard turns, the more so the more the vehicle drifts sideways",
    excited_by=("zigzag", "turning_circle", "stairs"),
    mistaken_for=("quadratic_damping", "sway_coupling", "heave_coupling", "stall", "speed_varying"),
    source="Fossen 2011, section 6.4.3",
    needs=("cross",),
    core=core,
)
