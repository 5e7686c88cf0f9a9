"""`sysid fit`, `turn-radius` and `schedule` as functions: from models at a few speeds to laws, turns and gains."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.face.arguments import (
    File,
    designed_from,
    fin_limit_of,
    fins_of,
    load_user_effects,
    runs_of_models,
    runs_of_turn,
    vehicle_of,
)
from fieldsid.face.models import Models, source_of
from fieldsid.face.runs import Logs, loaded_mapping, runs_mapped
from fieldsid.face.speeds import speeds_of

if TYPE_CHECKING:
    from fieldsid.logs import ChannelMap, Run
    from fieldsid.logs.several.sifting import Refused
    from fieldsid.plant.laws.axis_laws import Laws
    from fieldsid.schedule.record import Schedule
    from fieldsid.schedule.verify import Verification
    from fieldsid.turning.prediction import TurnPrediction
    from fieldsid.vehicle import Vehicle


def fit_laws(models: Models, *, unweighted: bool = False) -> Laws:
    """Return the laws that carry a model from one speed to the next: authority against u^2, damping and trim against u.

    models: models of one axis at two speeds or more, or a table of parameters with a column speed_m_s. unweighted: ignore the
    standard errors of the points. Raises DataError for one speed only.
    """
    load_user_effects()
    source = source_of(models)
    return source.fitted(weighted=not unweighted)


def turn_radius(
    models: Models,
    *,
    speeds: str | Sequence[float] | None = None,
    rudder_max: float | None = None,
    measured: Logs = (),
    runs: Logs | None = None,
    method: str = "auto",
    law: str | Sequence[str] = (),
    fin_zero: float = 0.0175,
    mapping: ChannelMap | File | None = None,
    vehicle: Vehicle | File | None = None,
    unfit: Refused[Run] | None = None,
) -> TurnPrediction:
    """Return the turning radius over speed, port and starboard apart, with 95 % bands.

    speeds: in m/s or as `0.5:2.5:0.1`; by default those of the models. rudder_max: in rad; by default the vehicle's limit, else
    the largest angle in the models' runs. measured: runs of turning circles to compare with and to learn from. runs: runs that
    the turn is fitted to, for the loss of speed; by default those that the model files name. fin_zero: fin offsets (rad) below it
    are ignored. unfit: called with each run that cannot be used, and the error, which is raised without it. Raises UsageError,
    ModelError for an unstable model, DataError for a measured run without a circle.
    """
    from fieldsid.turning.radius import turn_radius as radius_over_speed

    load_user_effects()
    source, known = source_of(models, law), vehicle_of(vehicle)
    if runs is None:
        fitted: Sequence[Run] = runs_of_turn(source, loaded_mapping(mapping))
    else:
        fitted = runs_mapped(runs, mapping, models=source.paths)
    return radius_over_speed(
        source,
        speeds_of(speeds) or source.knots,
        fin_limit_of(known, source, "rudder") if rudder_max is None else rudder_max,
        runs=fitted,
        measured=runs_mapped(measured, mapping, models=source.paths),
        method=method,
        fin_zero=fin_zero,
        unfit=unfit,
        length=known.length_m,
    )


def design_schedule(
    models: Models,
    *,
    controller: str | None = None,
    settling: float | None = None,
    bandwidth: float | None = None,
    overshoot: float | None = None,
    step: float | None = None,
    fin_use: float | None = None,
    damping: float | None = None,
    phase_margin: float = 45.0,
    speeds: str | Sequence[float] | None = None,
    fin_limit: float | None = None,
    fin_rate: float | None = None,
    fin_lag: float | None = None,
    delay: float | None = None,
    latency: float | None = None,
    depth: bool = False,
    law: str | Sequence[str] = (),
    vehicle: Vehicle | File | None = None,
) -> Schedule:
    """Return gains per speed for heading or pitch, by the models' axis.

    controller: p, pd, pi, pid or lqr; by default pd where the models' runs have a rate, else p. settling (s) or bandwidth
    (rad/s): how fast a step settles at every speed; by default as fast as the slowest speed allows, with settling 0 as fast as
    each speed allows. overshoot: the largest, as a share. step (rad): the error that uses a share fin_use of the fin's limit.
    damping: the damping ratio; by default that of the overshoot, else 0.7071. phase_margin: in deg. speeds: in m/s or as
    `1.0,1.5`; by default those of the models. fin_limit (rad), fin_rate (rad/s): by default the vehicle's. fin_lag, delay (s):
    by default the models'. latency (s): the autopilot's, in addition. depth: add the depth loop above pitch.
    Raises UsageError for impossible values, ModelError where no gain meets the requirements.
    """
    from fieldsid.schedule.linear_plant import FinLimits
    from fieldsid.schedule.make import design_schedule as design
    from fieldsid.schedule.make import usual_controller
    from fieldsid.schedule.wish import Wish

    load_user_effects()
    source, known = source_of(models, law), vehicle_of(vehicle)
    return design(
        source,
        fin_limit_of(known, source) if fin_limit is None else fin_limit,
        speeds=speeds_of(speeds),
        wish=Wish(controller or usual_controller(source), damping, phase_margin, step, bandwidth, settling, overshoot, fin_use),
        limits=FinLimits(fin_lag, delay, known.fin_rate_rad_s if fin_rate is None else fin_rate, latency),
        depth=depth,
        runs=runs_of_models(source, depth=depth),
        length=known.length_m,
        fins=fins_of(known, source.axis),
    )


def verify_schedule(schedule: Schedule | File, models: Models | None = None) -> Verification:
    """Return the margins and steps of a schedule at its knots and between them, over draws of the models' errors.

    models: the models to verify on; by default the files that it was designed from. Raises ArtifactError where one is missing.
    """
    from fieldsid.schedule.record import Schedule, load_schedule
    from fieldsid.schedule.verify import verify_schedule as verify

    load_user_effects()
    known = schedule if isinstance(schedule, Schedule) else load_schedule(Path(schedule))
    name = "SCHEDULE" if isinstance(schedule, Schedule) else str(schedule)
    source = source_of(designed_from(known, name) if models is None else models)
    return verify(known, source, runs=runs_of_models(source, depth=known.depth))
