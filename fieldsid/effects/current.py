"""A current across the course turns the hull by heading: r' += current_sin sin(psi) + current_cos cos(psi), rad/s^2.

In a frame that drifts with the water the hull still has its log's heading; what is left is the moment of the flow
across it, once per turn of the compass. In its other forms it goes twice as well, as the moment of a flow square across
a long hull does, its direction turns by current_turn rad/s and is the stated one in the middle of a run, or the moment goes
with a power of the run's speed: lift of the flow across the hull is in proportion to both. Or it is in the log and not on the
hull: a speed over ground (DVL with bottom lock, GPS) is the speed through the water, which the fin and the damping go with, and
the current along the heading, current_north cos(psi) + current_east sin(psi); a run's parameters then hold at its speed
through the water, and what `speed_varying` says of the speed is said of that through the water.
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
"""Headings that show it: within a quarter of the compass its sine is a straight line to 3 % of its own size (rms over +-45 deg),
a moment in proportion to the heading, as what a hull's slow sway leaves in a zig-zag is."""


def core(values: Values, scale: float) -> Core:
    """Return the core's coefficients; scale is the run's speed over the reference speed."""
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
    """Return the factors (n,) of a logged speed that is over ground; none where no heading is measured, as in a plan."""
    seen = record.angle_ok
    if "current_north" not in values or not seen.any():
        return Terms()
    heading = record.angle if seen.all() else np.interp(record.time, record.time[seen], record.angle[seen])
    surge, along = record["surge"], values["current_north"] * np.cos(heading) + values["current_east"] * np.sin(heading)
    run = max(float(np.median(surge - along)) / record.speed, MIN_SPEED_RATIO)  # as the run's speed is that of its log
    # `speed_varying` takes the logged speed over the run's: what is left is the one through the water over both
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
            only_with=("speed_varying",),
        ),
        Variant(
            "its direction turns",
            (Coefficient("current_turn", "rad/s", -0.1, 0.1, 0.0, scan=(-0.01, 0.01), says="how fast its direction turns"),),
        ),
    ),
)
