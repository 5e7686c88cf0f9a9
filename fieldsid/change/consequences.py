"""What a change of the vehicle means: the gain that would be designed now, the loop with the old gains, the turning radius."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldsid.change.record import LEVEL, Answers, GainChange, RadiusChange
from fieldsid.dynamics.free_run import command_record, effects_of, simulate
from fieldsid.errors import FieldsidError
from fieldsid.maneuvers import Limits, all_maneuvers
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.flight.dry_run import dry_run
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.schedule.controller import least_damping, margins
from fieldsid.schedule.linear_plant import FinLimits, LinearPlant, family_at
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.record import Row
from fieldsid.schedule.wish import Wish
from fieldsid.turning.radius import turn_radius

DRAWS, SEED = 400, 20
PULSES = "square_pulses"


def gain_changes(
    old: ParameterSource, new: ParameterSource, speeds: Sequence[float], fin_limit: float, stated: FinLimits
) -> tuple[GainChange, ...]:
    """Return the P gains at each speed for a fin with a largest angle (rad), and with lag, delay and rate where stated.

    Both are for the estimates themselves: a design that allows for the errors of a model has smaller gains the less is known of
    it, and two of one vehicle would differ. Raises ModelError where no gain stabilises one of the two loops.
    """
    was, now = (design_schedule(_exactly(s), fin_limit, speeds=speeds, wish=Wish(), limits=stated) for s in (old, new))
    level = LEVEL / len(speeds)  # Bonferroni: one family of intervals over the speeds
    return tuple(_gain_change(old, new, was.at(s), now.at(s), stated, level) for s in speeds)


def _exactly(source: ParameterSource) -> ParameterSource:
    """Return the source with its models as if they had no errors."""
    return replace(source, models=tuple(replace(m, covariance=np.zeros_like(m.covariance)) for m in source.models))


def _gain_change(old: ParameterSource, new: ParameterSource, was: Row, now: Row, stated: FinLimits, level: float) -> GainChange:
    speed = now.speed
    families = [family_at(source, speed, stated, DRAWS, SEED + 1000 * i) for i, source in enumerate((old, new))]
    ratio = _gain_by_formula(families[1]) / _gain_by_formula(families[0])
    change = now.gains.kp / was.gains.kp - 1.0
    # the draws give the relative width of the interval; its centre is the designed gain, which allows for lag and delay
    low, high = (float(np.quantile(ratio, q) / np.median(ratio)) for q in (0.5 * level, 1 - 0.5 * level))
    plant = families[1].one()
    return GainChange(
        speed, was.gains.kp, now.gains.kp, change, (float((1 + change) * low - 1.0), float((1 + change) * high - 1.0)),
        float(least_damping(plant, was.gains)[0]), float(margins(plant, was.gains).phase_deg[0]),
    )  # fmt: skip


def _gain_by_formula(plant: LinearPlant) -> FloatArray:
    """Return the gain for a damping ratio of 0.7071 by the formula, for each draw, (d,)."""
    authority = plant.slow_authority
    size = np.broadcast_to(np.abs(0.5 * plant.slow_damping**2 - plant.stiffness), authority.shape)
    count = min(DRAWS, authority.size)
    return np.asarray((size / np.abs(authority))[:count])


def radius_changes(
    old: ParameterSource, new: ParameterSource, speeds: Sequence[float], rudder: float
) -> tuple[RadiusChange, ...]:
    """Return the radius at each speed to both sides; raises UsageError and ModelError where there is no turn."""
    both = [turn_radius(source, speeds, rudder).rows for source in (old, new)]
    after = {(r.speed, r.side): r for r in both[1]}
    pairs = [(r, after[r.speed, r.side]) for r in both[0]]
    return tuple(RadiusChange(a.speed, a.side, a.radius, a.interval95, b.radius, b.interval95) for a, b in pairs)


def answers(old: ParameterSource, new: ParameterSource, speed: float, fin_max: float) -> Answers | None:
    """Return the responses of both vehicles to the same fin pulses at one speed in m/s; None where one cannot be simulated."""
    models = [s.models[s.near(speed)[0][0]] for s in (old, new)]
    if any(e.needs for m in models for e in effects_of(m)):
        return None
    maneuver, names = all_maneuvers()[PULSES], NAMES[models[0].axis]
    try:
        flown = dry_run(models[0], maneuver, maneuver.checked({}), speed=speed, limits=Limits(fin_max))
        fin = flown[names.fin]
        record = command_record(models[0].axis, flown.time, fin, speed=speed, signals={})
        rates = [simulate(m, record, state=(0.0, 0.0, 0.0)).rate for m in models]
    except FieldsidError:
        return None
    return Answers(speed, flown.time, fin, rates[0], rates[1])


def fin_of(models: Sequence[Model]) -> float | None:
    """Return the largest fin angle in the models' runs in rad; None where no model has it."""
    known = [m.trained.get("fin_max", 0.0) for m in models]
    return max(known) if known and max(known) > 0 else None
