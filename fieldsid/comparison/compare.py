"""A model against runs it may not have seen: how well its free run follows, and where it fails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.comparison.conditions import conditions
from fieldsid.comparison.localize import Place, Stretch, places, stretches
from fieldsid.comparison.metrics import Metrics, metrics
from fieldsid.comparison.residuals import Companion, companions
from fieldsid.fitting.merit import Merit, merit
from fieldsid.fitting.noise import floor_of
from fieldsid.fitting.predict import Prediction, predict
from fieldsid.logs.run import Run
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import record_of
from fieldsid.models.simulate import base_at

CHANNELS = ("angle", "rate")
DOWN_TO_NOISE = 1.3
"""Rms over the noise below which a channel has nothing left to show."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """One run: the free run, its merit, the run's own noise floor, metrics of the channel judged, and where it fails."""

    shown: Prediction
    merit: Merit
    floor: Noise
    channel: str
    metrics: Metrics
    where: tuple[Place, ...]
    worst: tuple[Stretch, ...]
    moves_with: tuple[Companion, ...]

    @property
    def run(self) -> str:
        """The run's name."""
        return self.shown.record.name


def compare(model: Model, runs: Sequence[Run]) -> tuple[Comparison, ...]:
    """Return the comparison of a model with each run.

    Its initial state, per-run nuisances, the command's times between samples and, within its measurement's error, the run's
    speed are refitted, nothing else.
    Raises DataError for a run without the signals, EffectError for one without a signal that an effect needs,
    ModelError when the model grows without bound.
    """
    return tuple(compare_one(model, run) for run in runs)


def compare_one(model: Model, run: Run) -> Comparison:
    """Return the comparison of a model with one run; raises as `compare` does."""
    record = record_of(run, model.axis)
    shown = predict(model, record)
    floor = floor_of([record])
    channel = judged(shown, floor)
    ok = record.ok[channel]
    square = shown.residual[channel] ** 2
    base = base_at(model, record.speed)
    trim = -base.trim / base.authority if base.authority != 0.0 else 0.0
    return Comparison(
        shown=shown,
        merit=merit([shown]),
        floor=floor,
        channel=CHANNELS[channel],
        metrics=metrics(shown, channel),
        where=places(record.time, square, ok, conditions(record, shown.rate, trim)),
        worst=stretches(record.time, square, ok),
        moves_with=companions(shown, base.damping),
    )


def judged(shown: Prediction, floor: Noise) -> int:
    """Return the channel that shows the fault: 1 the rate, or 0 the angle where the rate is down to its noise or missing.

    An error of the rate adds up in the angle and stays there, so the angle tells badly when the fault acted.
    """
    record, rms = shown.record, np.sqrt(np.mean(shown.residual**2, axis=1))
    if not record.rate_ok.any():
        return 0
    if not record.angle_ok.any():
        return 1
    angle, rate = rms[0] / floor.angle, rms[1] / floor.rate
    return 0 if rate < DOWN_TO_NOISE < angle else 1
