"""Lift falls off at large fin angles: beyond stall_angle the effective angle grows with slope_after only.

    delta = sign(d) (stall_angle + slope_after (|d| - stall_angle))   for |d| > stall_angle, else d
slope_after = 1 is no stall, 0 a constant lift beyond the angle, a negative one a falling lift. In its variants the corner is
rounded over stall_blend to either side, or the lift drops by the share stall_drop at the angle. Source: Whicker and Fehlner 1958,
DTMB report 933 (lift of low-aspect-ratio control surfaces).
"""

from __future__ import annotations

from fieldsid.effects._fin_reach import shares_of_reach
from fieldsid.effects._static_map import StaticMap
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values, Variant
from fieldsid.models.fin_path import FinPath
from fieldsid.models.record import Record


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path of the effective angle, (n-1,) rad."""
    angle = values["stall_angle"]
    bend = StaticMap(
        proportional=1.0,
        beyond=values["slope_after"] - 1.0,
        edge=angle,
        blend=values.get("stall_blend", 0.0),
        jump=-values.get("stall_drop", 0.0) * angle,
    )
    return bend.through(path, record.steps)


ANGLE = Coefficient("stall_angle", "rad", 0.03, 0.6, 0.2, step=5e-4, says="angle where the lift falls off")

EFFECT = Effect(
    name="stall",
    says="the lift of the fin falls off beyond an angle",
    stage=Stage.ACTUATOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="delta = sign(d) * (stall_angle + slope_after * (|d| - stall_angle)) for |d| > stall_angle, else d",
    coefficients=(
        ANGLE,
        Coefficient("slope_after", "1", -1.0, 0.99, 0.0, says="slope of the lift beyond it, as a share of the slope before"),
    ),
    telltale="large commands give less turn than simulated while small ones fit, whatever the rate",
    excited_by=("stairs", "square_pulses", "multisine", "zigzag", "turning_circle"),
    mistaken_for=("quadratic_damping", "deadband", "rate_limit", "crossflow_drag", "asymmetric_fin"),
    source="Whicker and Fehlner 1958, DTMB report 933",
    order=70,
    variants=(
        Variant(
            "the lift bends off smoothly",
            (
                Coefficient(
                    "stall_blend",
                    "rad",
                    0.0,
                    0.3,
                    0.05,
                    scan=(0.03, 0.1),
                    step=5e-4,
                    says="angle over which the corner is rounded",
                ),
            ),
        ),
        Variant(
            "the lift drops at the angle",
            (Coefficient("stall_drop", "1", 0.0, 1.0, 0.2, scan=(0.1, 0.3, 0.6), step=1e-3, says="share of lift lost at once"),),
        ),
    ),
    fin=fin,
    initial_guesses=shares_of_reach(ANGLE, (0.3, 0.5, 0.7, 0.85, 0.95)),
)
