"""A trim moment that grows with speed: q' += speed_moment u^2, u the smoothed surge in m/s, speed_moment in 1/m^2.

It is the lift of a hull that is not symmetric top to bottom; the trim Cb is then that at zero speed. In its variant the moment is
speed_moment u^speed_power, as where the flow separates.
Source: Prestero 2001, chapter 4 (body lift moment M_uw u w and fin moment, both ~ u^2).
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values, Variant
from fieldsid.models.record import Record


def terms(values: Values, record: Record) -> Terms:
    """Return the moment of the speed, (n,) rad/s^2."""
    if "speed_power" in values:
        return Terms(moment=values["speed_moment"] * np.maximum(record["surge"], 0.0) ** values["speed_power"])
    return Terms(moment=values["speed_moment"] * record["surge"] ** 2)


EFFECT = Effect(
    name="speed_moment",
    says="a pitch trim moment grows with the square of the speed",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.PITCH,),
    equation="q' += speed_moment * u^2 (trim: at zero speed)",
    coefficients=(Coefficient("speed_moment", "1/m^2", -2.0, 2.0, 0.005, says="pitch moment per (m/s)^2"),),
    telltale="the trim found differs from speed to speed, and the residual pitch follows the speed within a run",
    excited_by=("square_pulses", "multisine"),
    mistaken_for=("prop_moment", "speed_varying", "trim_drift", "depth_buoyancy"),
    source="Prestero 2001, chapter 4",
    needs=("surge",),
    terms=terms,
    variants=(
        Variant(
            "it goes with another power of the speed",
            (Coefficient("speed_power", "1", 0.5, 4.0, 2.0, step=1e-3, says="power of the speed it goes with"),),
        ),
    ),
)
