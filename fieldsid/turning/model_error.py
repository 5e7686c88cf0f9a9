"""The model error of a steady turn, by how far the data of the model cover that turn.

Short pulses show neither the steady drift (Munk moment), nor the drag in r|r|, nor the loss of speed; a first-order fit then
predicts too small a radius. Means and standard deviations below come from an ensemble: 50 straight-line stable vehicles about
Prestero's REMUS (2001; coefficients varied by 30 to 70 %, servo lags of 0.07 to 0.3 s), identified from 2 s pulses, or pulses and
a zig-zag, and turned at 0.26 to 0.5 rad. The log of true over predicted radius was, for the steady circle of the first-order
model, 0.39 +/- 0.13 with 60 to 80 % of the rate covered and 0.15 +/- 0.07 with all of it; for the u-turn formula 0.16 +/- 0.07
and 0.05 +/- 0.05. The values for the formula are widened to cover errors of -43 .. +13 % of vehicles outside the ensemble.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.models.effect import Effect
from fieldsid.numerics.arrays import FloatArray

MIN_COVERED_SHARE = 0.8
"""Share of the turn's fin angle, rate or duration from which on the data cover it."""
STEADY_TURN_LOG_SD = 0.05
"""Log error with a cross state or a rising damping: -0.06 +/- 0.04 on the ensemble with 80 to 100 % of the rate covered,
-0.01 +/- 0.04 beyond. It is wider because a fit without the loss of speed was 8 to 10 % off on a vehicle outside the ensemble."""
UNSEEN_SWAY_LOG_SD = 0.06
"""Additional log error where the fitted sway mode is slower than the longest turn in the data, which did not show its effect."""
STALL_LOG_SD = 0.04
"""Additional log error for a fin angle that was not flown: the lift slope falls slightly before the stall and strongly after."""


@dataclass(frozen=True, slots=True)
class ModelError:
    """Mean and standard deviation of log(true radius / predicted radius)."""

    mean: float
    sd: float

    def factors(self, count: int, seed: int) -> FloatArray:
        """Return draws (count,) of the true over the predicted radius."""
        return np.exp(self.mean + self.sd * np.random.default_rng(seed).standard_normal(count))


@dataclass(frozen=True, slots=True)
class DataCoverage:
    """How far the data cover a turn: their largest fin angle, rate and duration of a turn over those of it, NaN if not known.

    `speed_flown`: the data contain this speed. `sway_settles`: the sway mode settles within the longest turn of the data.
    """

    fin: float
    rate: float
    hold: float
    speed_flown: bool
    sway_settles: bool = True

    @property
    def missing(self) -> tuple[str, ...]:
        """What the data did not cover, in words; empty when they covered all."""
        phrases = {
            "fin": "a fin angle this large was not flown",
            "rate": "a yaw rate this high was not reached",
            "hold": "no turn was held long enough to settle",
        }
        words = [says for part, says in phrases.items() if not getattr(self, part) >= MIN_COVERED_SHARE]
        sway = () if self.sway_settles else ("the model's sway settles more slowly than any turn was held",)
        return (*words, *sway, *(() if self.speed_flown else ("this speed was not flown",)))


def data_coverage(
    trained: Mapping[str, float], *, fin: float, rate: float, quarter_s: float, speed_flown: bool, sway_settles: bool = True
) -> DataCoverage:
    """Return the coverage by `trained` of a turn with `fin` rad and `rate` rad/s that reaches 90 deg after `quarter_s` s."""
    nan = float("nan")
    return DataCoverage(
        fin=trained.get("fin_max", nan) / fin,
        rate=trained.get("rate_max", nan) / rate if rate > 0 else nan,
        hold=trained.get("held_s", nan) / quarter_s if quarter_s > 0 else nan,
        speed_flown=speed_flown,
        sway_settles=sway_settles,
    )


def model_error(effects: Iterable[Effect], coverage: DataCoverage, *, formula: bool) -> ModelError:
    """Return the model error of a radius, which is the smaller the more of the turn the data cover.

    `formula`: the radius is that of the u-turn formula (constant speed, with the ramps of the rate), else that of the settled
    circle. An unknown coverage (a table) is that of short pulses. The error of a settled circle is smaller for a model with a
    cross state or a damping that grows with the rate.
    """
    rate = 1.0 - _share(coverage.rate, unknown=0.6)
    hold = 1.0 - _share(coverage.hold, unknown=0.3)
    fin = 1.0 - _share(coverage.fin, unknown=0.5)
    spread = 0.10 * max(rate, hold) + STALL_LOG_SD * fin
    if formula:
        return ModelError(0.04 + 0.30 * rate + 0.05 * hold, 0.10 + spread)
    if not any(e.extra_states or e.limits_rate for e in effects):
        return ModelError(0.12 + 0.50 * rate + 0.10 * hold, 0.10 + spread)
    return ModelError(
        0.15 * max(rate, hold), STEADY_TURN_LOG_SD + spread + (0.0 if coverage.sway_settles else UNSEEN_SWAY_LOG_SD)
    )


def _share(value: float, *, unknown: float) -> float:
    return float(np.clip(value, 0.0, 1.0)) if np.isfinite(value) else unknown
