"""Buoyancy and its centre shift with depth: q' += depth_moment z, z in m positive down, depth_moment in 1/(m s^2).

A hull that compresses, foam that soaks or a free surface nearby causes it; the trim Cb is then that at zero depth. In its variant
a part of the moment is proportional to the square of the depth.
Source: Fossen 2011, section 4.1 (restoring moment), with a buoyancy linear in depth.
"""

from __future__ import annotations

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values, Variant
from fieldsid.models.record import Record


def terms(values: Values, record: Record) -> Terms:
    """Return the moment of the depth, (n,) rad/s^2."""
    depth = record["depth"]
    return Terms(moment=values["depth_moment"] * depth + values.get("depth_square", 0.0) * depth * depth)


EFFECT = Effect(
    name="depth_buoyancy",
    says="the pitch trim shifts with depth",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.PITCH,),
    equation="q' += depth_moment * z (trim: at zero depth)",
    coefficients=(Coefficient("depth_moment", "1/(m s^2)", -2.0, 2.0, 0.005, says="pitch moment per metre of depth"),),
    telltale="the residual pitch moves with depth, slower than any answer to the fin",
    excited_by=("square_pulses", "doublet", "chirp"),
    mistaken_for=("trim_drift", "heave_coupling", "speed_moment", "wave"),
    source="Fossen 2011, section 4.1",
    needs=("depth",),
    terms=terms,
    variants=(
        Variant(
            "a part goes with the square of the depth",
            (Coefficient("depth_square", "1/(m^2 s^2)", -2.0, 2.0, 0.0, says="pitch moment per square metre of depth"),),
        ),
    ),
)
