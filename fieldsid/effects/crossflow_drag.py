"""Drag of the cross flow summed along the hull, from the measured sway (yaw) or heave (pitch) speed.

    p' += -crossflow F(v / length, p),   F(a, p) = 32 int_{-1/2}^{1/2} (a + x p) |a + x p| x dx
so that F(0, p) = p |p|: without drift it is quadratic damping. crossflow >= 0 in 1/rad, length of the hull in m.
What a sensor's noise leaves in v becomes a moment that was not there. So in another variant y = v/length is a state, from the law
by which a hull drifts, and needs no length; f = speed / reference speed:
    y' = -flow_damping f y - flow_rate f p + flow_fin f^2 delta
Source: Fossen 2011, section 6.4.3 (cross-flow drag principle), uniform section drag.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Core, Effect, Stage, Values, Variant
from fieldsid.models.helpers.drift_law import drift_law
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

LENGTH = Coefficient("length", "m", 0.3, 10.0, 2.0, scan=(0.8, 2.0, 5.0), step=1e-3, says="length of hull in the cross flow")
FLOW_DAMPING = Coefficient("flow_damping", "1/s", 0.05, 10.0, 1.0, step=1e-3, says="damping of the cross flow")
FLOW_RATE = Coefficient("flow_rate", "1/s", -20.0, 20.0, 0.2, step=1e-3, says="cross flow over length that turning makes")
FLOW_FIN = Coefficient("flow_fin", "1/s^2", -20.0, 20.0, 0.0, step=1e-3, says="cross flow over length that the fin makes")


def core(values: Values, scale: float) -> Core:
    """Return the core's coefficients; speed has a part in the drift alone, whose state is f y in 1/s."""
    if "flow_damping" not in values:
        return Core(crossflow=values["crossflow"], length=values["length"])
    return Core(
        strip_moment=values["crossflow"],
        strip_flow=1.0 / scale,
        cross_share=0.0,
        cross_damping=values["flow_damping"] * scale,
        cross_rate=values["flow_rate"] * scale**2,
        cross_fin=values["flow_fin"] * scale**3,
    )


def flow_starts(records: Sequence[Record], _residuals: Sequence[FloatArray]) -> list[dict[str, float]]:
    """Return the drift law that the measured cross speed shows, over some lengths of a hull."""
    reference = float(np.mean([r.speed for r in records]))
    law = drift_law(records, reference)
    rate, fin = -law.per_rate / law.time_constant, law.per_fin / law.time_constant
    return [
        {"flow_damping": 1.0 / law.time_constant, "flow_rate": rate / length, "flow_fin": fin / length} for length in LENGTH.scan
    ]


EFFECT = Effect(
    name="crossflow_drag",
    says="drag of the cross flow, summed along the hull, when it turns and drifts at once",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="p' += -crossflow * 32 * integral of (v/length + x p)|v/length + x p| x dx over x = -1/2 .. 1/2",
    coefficients=(
        Coefficient("crossflow", "1/rad", 0.0, 500.0, 0.1, scan=(0.1, 1.0, 5.0), says="damping per rad/s of rate without drift"),
        LENGTH,
    ),
    telltale="too much rate is simulated in hard turns, the more so the more the vehicle drifts sideways",
    excited_by=("zigzag", "turning_circle", "stairs"),
    mistaken_for=("quadratic_damping", "sway_coupling", "heave_coupling", "stall", "speed_varying"),
    source="Fossen 2011, section 6.4.3",
    needs=("cross",),
    core=core,
    variants=(
        Variant(
            "its cross flow is that of the law by which the hull drifts, not the one measured",
            (FLOW_DAMPING, FLOW_RATE, FLOW_FIN),
            initial_guesses=flow_starts,
            without=("length",),
            extra_states=("cross flow",),
        ),
    ),
)
