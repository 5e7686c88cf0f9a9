"""The propeller turns the hull: moment = prop_moment thrust, in rad/s^2 per unit of the logged thrust.

Swirl over the fins, or a thrust line that misses the centre of gravity, causes it; the trim is then that at zero thrust. A
positive moment turns toward positive angle. In one variant a part is proportional to the square of the thrust. In yaw the moment
may follow the thrust with a first-order lag, as swirl and inflow do, or the rudder may be trimmed against it: the trim moment
then has a part prop_trimmed (u^2 - 1) in addition to the constant one, u the run's speed in m/s; the constant one is thus the
trim at 1 m/s. In pitch `speed_moment` has such a part. Source: Carlton 2018, Marine Propellers and Propulsion, chapter 6.
"""

from __future__ import annotations

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values, Variant
from fieldsid.models.record import Record
from fieldsid.numerics.first_order_lag import first_order_lag

FASTEST_S = 1e-6
"""A lag below this has no effect on the samples."""


def terms(values: Values, record: Record) -> Terms:
    """Return the moment of the propeller, (n,) rad/s^2."""
    thrust, lag = record["thrust"], float(values.get("build_up", 0.0))
    if lag > FASTEST_S:
        thrust = first_order_lag(record.steps, thrust, lag)
    moment = values["prop_moment"] * thrust + values.get("prop_square", 0.0) * thrust * thrust
    trimmed = float(values.get("prop_trimmed", 0.0))
    return Terms(moment=moment + trimmed * (record.speed**2 - 1.0) if trimmed else moment)


SQUARE = Coefficient("prop_square", "rad/s^2 per unit squared", -1e3, 1e3, 0.0, says="moment per square of the logged thrust")
TRIMMED = Coefficient("prop_trimmed", "1/m^2", -2.0, 2.0, 0.0, says="trim moment per (m/s)^2, from 1 m/s on")

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
    variants=(
        Variant("a part goes with the square of the thrust", (SQUARE,)),
        Variant(
            "it builds up behind the thrust",
            (Coefficient("build_up", "s", 0.0, 20.0, 1.0, scan=(0.5, 2.0, 6.0), step=1e-3, says="time it builds up in"),),
            axes=(Axis.YAW,),
        ),
        Variant("the rudder is trimmed against it", (TRIMMED,), axes=(Axis.YAW,), needs=("surge",)),
        Variant(
            "a part goes with the square of the thrust, and the rudder is trimmed against it",
            (SQUARE, TRIMMED),
            axes=(Axis.YAW,),
            needs=("surge",),
        ),
    ),
)
