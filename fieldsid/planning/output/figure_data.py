"""The data of a leg's figure: command, predicted response with its band, envelope and track."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.design.best_leg import COARSE_DRAWS
from fieldsid.planning.design.leg import Leg, commands_of, error_in_words
from fieldsid.planning.design.plan import Plan
from fieldsid.planning.flight.excitation import flown
from fieldsid.planning.flight.operating_point import operating_point
from fieldsid.planning.safety.envelope import Envelope, track_of
from fieldsid.planning.safety.monte_carlo import draw_ensemble, fly_ensemble

LEVELS = (0.025, 0.16, 0.84, 0.975)
TRACKS = 25


@dataclass(frozen=True, slots=True)
class LegFigure:
    """One leg over time (n,) s: fin (rad), 1 where the autopilot steers, angle (rad) and its quantiles (4, n).

    `along` and `across` (n,) are the track of the prior's mean, `tracks` (2, m, n) those of some draws, in m; `errors` are the
    parameters' expected standard errors in words; `run_up_m` is the length of the straight run before the window.
    """

    axis: Axis
    title: str
    time: FloatArray
    fin: FloatArray
    autopilot: FloatArray
    angle: FloatArray
    band: FloatArray
    along: FloatArray
    across: FloatArray
    tracks: FloatArray
    envelope: Envelope
    errors: Mapping[str, str]
    run_up_m: float


def figure_data(plan: Plan, leg: Leg, model: Model) -> LegFigure:
    """Return the data of a leg's figure, with draws of the prior simulated again."""
    envelope = plan.envelope
    ensemble = draw_ensemble(model, leg.speed, leg.window, COARSE_DRAWS, plan.seed + 9)
    flights = fly_ensemble(ensemble, leg.candidate, envelope, leg.autopilot, 0.0)
    mean = flown(operating_point(model, leg.speed), leg.candidate, leg.window, envelope.limits, leg.autopilot)
    n = min(flights.time.size, mean.time.size)
    _, fin, steered = commands_of(leg, envelope)
    along, across = track_of(plan.axis, mean.angle, leg.speed, 1.0 / leg.window.rate_hz)
    tracks = np.stack([flights.along[:n, :TRACKS].T, flights.side[:n, :TRACKS].T])
    shown = np.where(steered[:n] > 0, mean.command[:n], fin[:n])
    errors = {k: error_in_words(e.value, e.std_error, e.relative) for k, e in leg.expected.items() if np.isfinite(e.std_error)}
    return LegFigure(
        plan.axis, f"{leg.speed:g} m/s  {leg.candidate.maneuver}", mean.time[:n], shown, steered[:n], mean.angle[:n],
        np.quantile(flights.angle[:n], LEVELS, axis=1), along[:n], across[:n], tracks, leg.envelope_in(envelope), errors,
        leg.run_up_s * leg.speed,
    )  # fmt: skip
