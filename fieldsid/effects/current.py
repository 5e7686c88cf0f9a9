"""A current has a yaw moment that depends on the heading: r' += current_sin sin(psi) + current_cos cos(psi), rad/s^2.

The moment of the flow across the hull has the period of one turn of the compass. Variants: it has a part of twice that frequency,
as the moment of a flow across a long hull has; its direction turns by current_turn rad/s and is the stated one in the middle of a
run; it is proportional to a power (current_power) of the run's speed, as lift of the flow across the hull is. In one more variant
the current acts on the log and not on the hull: the logged speed is over ground (DVL with bottom lock, GPS) and is the sum of the
speed through the water, on which fin and damping depend, and the current along the heading, current_north cos(psi) +
current_east sin(psi). A run's parameters then hold at its speed through the water, and so do the exponents of `speed_varying`.
Source: Fossen 2011, sections 8.3 (ocean current forces and moments) and 6.4 (lift against u^2).
"""

from __future__ import annotations

import numpy as np

from fieldsid.effects._speed_powers import MIN_SPEED_RATIO, speed_powers
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values, Variant
from fieldsid.models.hull import Core
from fieldsid.models.record import Record

HEADING_SPAN_RAD = 0.5 * np.pi
"""Range of headings that is needed: within +-45 deg the sine is linear to 3 % (rms), and a slow sway that is missing from the
model also leaves a residual moment in proportion to the heading in a zig-zag."""


def core(values: Values, scale: float) -> Core:
    """Return the core's constants; scale is the run's speed over the reference speed."""
    if "current_north" in values:
        return Core()
    lift = scale ** values["current_power"] if "current_power" in values else 1.0
    return Core(
        heading_sin=values["current_sin"] * lift,
        heading_cos=values["current_cos"] * lift,
        heading_sin2=values.get("current_sin2", 0.0),
        heading_cos2=values.get("current_cos2", 0.0),
        heading_turn=values.get("current_turn", 0.0),
    )


def terms(values: Values, record: Record) -> Terms:
    """Return the factors (n,) of the speed through the water if the log has it over ground; none without a measured heading."""
    seen = record.angle_ok
    if "current_north" not in values or not seen.any():
        return Terms()
    heading = record.angle if seen.all() else np.interp(record.time, record.time[seen], record.angle[seen])
    surge, along = record["surge"], values["current_north"] * np.cos(heading) + values["current_east"] * np.sin(heading)
    run = max(float(np.median(surge - along)) / record.speed, MIN_SPEED_RATIO)  # record.speed is the median over ground
    # `speed_varying` applies the logged speed over the run's: these factors add the ratio of the speed through the water to it
    return speed_powers(values, (surge - along) / (run * np.maximum(surge, MIN_SPEED_RATIO * record.speed)), run)


EFFECT = Effect(
    name="current",
    says="a current makes the hull answer differently on every heading",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW,),
    equation="r' += current_sin * sin(psi) + current_cos * cos(psi)",
    coefficients=(
        Coefficient("current_sin", "rad/s^2", -1.0, 1.0, 0.002, says="moment on a heading of east"),
        Coefficient("current_cos", "rad/s^2", -1.0, 1.0, 0.002, says="moment on a heading of north"),
    ),
    telltale="the residual moment goes once around with the heading and changes sign on the opposite course",
    excited_by=("turning_circle", "zigzag"),
    mistaken_for=("compass_deviation", "trim_drift", "wave", "asymmetric_fin"),
    source="Fossen 2011, section 8.3",
    heading_span=HEADING_SPAN_RAD,
    core=core,
    terms=terms,
    variants=(
        Variant(
            "it goes twice per turn of the compass as well",
            (
                Coefficient("current_sin2", "rad/s^2", -1.0, 1.0, 0.0, says="its part with the sine of twice the heading"),
                Coefficient("current_cos2", "rad/s^2", -1.0, 1.0, 0.0, says="its part with the cosine of twice the heading"),
            ),
        ),
        Variant(
            "it grows with the speed",
            (Coefficient("current_power", "1", -1.0, 3.0, 1.0, step=1e-3, says="power of the run's speed it goes with"),),
        ),
        Variant(
            "the logged speed is over ground, and the one through the water differs by heading",
            (
                Coefficient("current_north", "m/s", -1.5, 1.5, 0.0, scan=(-0.3, 0.3), says="the water's velocity to the north"),
                Coefficient("current_east", "m/s", -1.5, 1.5, 0.0, scan=(-0.3, 0.3), says="to the east"),
            ),
            needs=("surge",),
            without=("current_sin", "current_cos"),
        ),
        Variant(
            "its direction turns",
            (Coefficient("current_turn", "rad/s", -0.1, 0.1, 0.0, scan=(-0.01, 0.01), says="how fast its direction turns"),),
        ),
    ),
)
