"""Drag of the cross flow summed along the hull, whose sway (yaw) or heave (pitch) is a state of the model.

    p' += -crossflow F(y, p),   F(a, p) = 32 int_{-1/2}^{1/2} (a + x p) |a + x p| x dx
    y' = -flow_damping f y - flow_rate f p + flow_fin f^2 delta,   f = speed / reference speed
so that F(0, p) = p |p|: without drift it is quadratic damping. y is the cross speed over the length of the hull, in rad/s;
crossflow >= 0 in 1/rad. Changing the signs of y, flow_rate and flow_fin together leaves the motion as it is. Compared with the
variant of `sway_coupling` that sums the drag along the hull, it has no Munk moment and no drag in the equation of the drift.
Together with `sway_coupling` or `heave_coupling` there is only one cross state, the moment x of that effect, and y = flow_share
x; flow_share of either sign gives the same motion.
Source: Fossen 2011, section 6.4.3 (cross-flow drag principle), uniform section drag.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values, Variant
from fieldsid.models.helpers.drift_law import drift_law, reference_speed
from fieldsid.models.hull import Core
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

LENGTHS_M = (0.8, 2.0, 5.0)
"""Hull lengths by which a measured cross speed is divided for start values."""
DRAG = Coefficient("crossflow", "1/rad", 0.0, 500.0, 0.1, scan=(1.0,), says="damping per rad/s of rate without drift")
FLOW = (
    Coefficient(
        "flow_damping", "1/s", 0.05, 10.0, 1.0, scan=(0.3, 1.0), step=1e-3, rate_exponent=1, says="damping of the cross flow"
    ),
    Coefficient(
        "flow_rate", "1/s", -20.0, 20.0, 0.2, scan=(0.2, 0.6, 1.5), step=1e-3, rate_exponent=1,
        says="cross flow over length that turning makes",
    ),
    Coefficient("flow_fin", "1/s^2", -20.0, 20.0, 0.0, step=1e-3, says="cross flow over length that the fin makes"),
)  # fmt: skip
SHARE = Coefficient(
    "flow_share", "s", 0.0, 100.0, 1.0, scan=(0.3, 3.0), step=1e-3, rate_exponent=-1,
    says="cross flow over length, per moment of the cross state",
)  # fmt: skip


def core(values: Values, scale: float) -> Core:
    """Return the core's constants; only the drift depends on the speed; its state is f y."""
    if "flow_share" in values:
        return Core(strip_moment=values["crossflow"], strip_flow=values["flow_share"] / scale)
    return Core(
        strip_moment=values["crossflow"],
        strip_flow=1.0 / scale,
        cross_share=0.0,
        cross_damping=values["flow_damping"] * scale,
        cross_rate=values["flow_rate"] * scale**2,
        cross_fin=values["flow_fin"] * scale**3,
    )


def measured_starts(records: Sequence[Record], _residuals: Sequence[FloatArray]) -> list[dict[str, float]]:
    """Return start values from the measured drift law, one for each of LENGTHS_M; none if no cross speed is measured."""
    law = drift_law(records, reference_speed(records))
    if law is None:
        return []
    damping = 1.0 / law.time_constant
    flows = ({"flow_rate": -law.per_rate * damping / length, "flow_fin": law.per_fin * damping / length} for length in LENGTHS_M)
    return [{"crossflow": DRAG.scan[0], "flow_damping": damping} | flow for flow in flows]


EFFECT = Effect(
    name="crossflow_drag",
    says="drag of the cross flow, summed along the hull, when it turns and drifts at once",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="p' += -crossflow * 32 * integral of (y + x p)|y + x p| x dx over x = -1/2 .. 1/2; "
    "y' = -flow_damping f y - flow_rate f p + flow_fin f^2 delta, f = speed/reference",
    coefficients=(DRAG, *FLOW),
    telltale="too much rate is simulated in hard turns, the more so the more the vehicle drifts sideways",
    excited_by=("zigzag", "turning_circle", "stairs"),
    mistaken_for=("quadratic_damping", "sway_coupling", "heave_coupling", "stall", "speed_varying"),
    source="Fossen 2011, section 6.4.3",
    extra_states=("cross flow",),
    log_prior_penalty=6.0,  # quadratic damping and a sway coupling explain most of it more simply
    core=core,
    initial_guesses=measured_starts,
    variants=(
        Variant(
            "its cross flow is that of the sway or heave coupling beside it",
            (SHARE,),
            without=tuple(c.name for c in FLOW),
            extra_states=(),
        ),
    ),
)
