"""Comparison of a model with runs, also with runs it was not fitted to: how well its free run follows, and where it fails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from fieldsid.comparison.conditions import conditions
from fieldsid.comparison.localize import Place, Stretch, places, stretches
from fieldsid.comparison.metrics import Metrics, metrics
from fieldsid.comparison.residuals import Companion, companions
from fieldsid.comparison.sufficient import is_noise, pooled
from fieldsid.display import Brief, Plotted
from fieldsid.dynamics.free_run import base_at
from fieldsid.fitting.predict.goodness_of_fit import GoodnessOfFit, goodness_of_fit
from fieldsid.fitting.predict.predict import Prediction, predict
from fieldsid.logs.run import Run
from fieldsid.logs.several.sifting import Refused, attempt, sifted
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import record_of
from fieldsid.noise.white_floor import told_floor, white_noise_floor
from fieldsid.records.keys import INLINE, Key
from fieldsid.rounding import MANY


def left_in_words(over_floor: float, fit: float, digits: int = 1) -> str:
    """Return a model's error in a channel in words: over its noise, or the fit in percent for a log without noise."""
    return f"{over_floor:.{digits}f} x its noise" if over_floor < MANY else f"fit {fit:.1f} %"


def badness(over_floor: float, fit: float) -> tuple[float, float]:
    """Return the sorting key of channels and runs: the error over the noise, then 100 less the fit in percent.

    The fit decides for logs without noise, whose floor is that of their digits and cannot be compared between channels.
    """
    return min(over_floor, MANY), 100.0 - fit


@dataclass(frozen=True, slots=True, repr=False)
class Channel(Brief):
    """One measured channel, `angle` or `rate`: rms over its noise floor, fit in percent, metrics, and where its error falls."""

    name: Annotated[str, Key("The channel.", "channel", of=Literal["angle", "rate"])]
    over_floor: float
    fit: float
    metrics: Annotated[Metrics, INLINE]
    where: Annotated[tuple[Place, ...], Key("Where it fails, the worst first.")]
    worst: Annotated[tuple[Stretch, ...], Key("The worst stretches of two seconds.")]

    @property
    def badness(self) -> tuple[float, float]:
        """The sorting key among channels, see `badness`."""
        return badness(self.over_floor, self.fit)


@dataclass(frozen=True, slots=True, repr=False)
class Comparison(Plotted):
    """One run: free run, merit, noise floor, its channels, the worst first, and the model."""

    shown: Prediction
    merit: Annotated[GoodnessOfFit, INLINE]
    floor: Annotated[Noise, Key("Noise of its sensors.", "noise_floor")]
    channels: tuple[Channel, ...]
    moves_with: tuple[Companion, ...]
    model: Model

    @property
    def run(self) -> Annotated[str, Key()]:
        """Its name."""
        return self.shown.record.name

    @property
    def worst_channel(self) -> Channel:
        """The worst channel: the one furthest above its noise floor, or of less fit in a log without noise."""
        return self.channels[0]

    @property
    def over_noise(self) -> Annotated[float, Key()]:
        """Error over the noise floor, the measured channels pooled: what says whether the run fails."""
        return pooled(c.over_floor for c in self.channels)

    @property
    def badness(self) -> tuple[float, float]:
        """The sorting key among runs, see `badness`."""
        return badness(self.over_noise, self.worst_channel.fit)

    @property
    def failing(self) -> Annotated[tuple[Channel, ...], Key()]:
        """The channels that have more left than their noise, the worst first; none where the run as a whole has not."""
        return () if is_noise(self.over_noise) else tuple(c for c in self.channels if not is_noise(c.over_floor))

    @property
    def where(self) -> tuple[Place, ...]:
        """The places of the worst channel's error."""
        return self.worst_channel.where


def compare(model: Model, runs: Sequence[Run], *, unfit: Refused[Run] | None = None) -> tuple[Comparison, ...]:
    """Return the comparison of a model with each run.

    Only the initial state, the nuisance parameters of the run, the times of the command between samples and, within its
    measurement error, the speed are refitted. `unfit` is called with each of several runs that cannot be compared; without
    `unfit`, for a single run, and where no run can be compared, the error of the run is raised. Raises DataError for a run
    without the signals, EffectError for one without a signal that an effect needs, ModelError when the model grows without bound.
    """
    made = (attempt(lambda one: compare_one(model, one), run) for run in runs)
    return tuple(found for _, found in sifted(runs, made, unfit))


def compare_one(model: Model, run: Run) -> Comparison:
    """Return the comparison of a model with one run; raises as `compare` does."""
    record = record_of(run, model.axis)
    shown = predict(model, record)
    base = base_at(model, record.speed)
    trim = -base.trim / base.authority if base.authority != 0.0 else 0.0
    floor = told_floor(white_noise_floor([record]), [record])
    return Comparison(
        shown, goodness_of_fit([shown]), floor, _channels(shown, floor, trim), companions(shown, base.damping), model
    )


def _channels(shown: Prediction, floor: Noise, trim: float) -> tuple[Channel, ...]:
    """Return the measured channels, the worst first; trim is the fin at rest in rad."""
    record, found = shown.record, goodness_of_fit([shown])
    parts = (("angle", found.angle_rms / floor.angle, found.angle_fit), ("rate", found.rate_rms / floor.rate, found.rate_fit))
    cases = conditions(record, shown.rate, trim)
    channels = []
    for i, (name, over, fit) in enumerate(parts):
        ok, square = record.ok[i], shown.residual[i] ** 2
        if ok.any():
            falls = places(record.time, square, ok, cases), stretches(record.time, square, ok)
            channels.append(Channel(name, over, fit, metrics(shown, i), *falls))
    return tuple(sorted(channels, key=lambda c: c.badness, reverse=True))
