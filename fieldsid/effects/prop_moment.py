"""The propeller turns the hull: moment = prop_moment thrust, in rad/s^2 per unit of the logged thrust.

Swirl over the fins and a thrust line beside the centre of gravity both do this; the trim is then that at zero
thrust. Positive turns toward positive angle. Source: Carlton 2018, Marine Propellers and Propulsion, chapter 6.
"""

from __future__ import annotations

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values
from fieldsid.models.record import Record


def terms(values: Values, record: Record) -> Terms:
    """Return the moment of the propeller, (n,) rad/s^2."""
    return Terms(moment=values["prop_moment"] * record["thrust"])


EFFECT = Effect(
    name="prop_moment",
    says="the propeller's thrust turns the hull",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="moment = prop_moment * thrust (trim: at zero thrust)",
    coefficients=(
        Coefficient("prop_moment", "rad/s^2 per unit thrust", -1e3, 1e3, 1e-3, says="moment per unit of the logged thrust"),
    ),
    telltale="the residual rate steps with every change of thrust, and the trim found differs from thrust to thrust",
    excited_by=("square_pulses", "multisine"),
    mistaken_for=("speed_moment", "speed_varying", "trim_drift", "step_change"),
    source="Carlton 2018, Marine Propellers and Propulsion, chapter 6",
    needs=("thrust",),
    terms=terms,
)
