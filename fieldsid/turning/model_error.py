"""The model error of a steady turn: how far the training data cover it, and the error that remains, as draws.

Short pulses show neither the steady drift (Munk moment), nor the drag that grows with r|r|, nor the speed loss; a first-order fit
then predicts too small a radius. The means and spreads below were set from an ensemble: 50 straight-line stable vehicles about
Prestero's REMUS (2001; coefficients spread by 30 to 70 %, servo lags of 0.07 to 0.3 s), identified from 2 s pulses, or pulses and
a zig-zag, and turned at 0.26 to 0.5 rad. Log of true over predicted radius there: steady circle of the first-order model 0.39 +/-
0.13 where 60 to 80 % of the rate was covered and 0.15 +/- 0.07 where all of it was; u-turn formula 0.16 +/- 0.07 and 0.05 +/-
0.05. The formula's values are widened so that errors of -43 .. +13 %, found on vehicles outside the ensemble, are covered.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.models.effect import Effect
from fieldsid.numerics.arrays import FloatArray

MIN_COVERED_SHARE = 0.8
"""Share of the turn's fin, rate or duration from which the data count as having reached it."""
STEADY_TURN_LOG_SD = 0.05
"""Ensemble, pulses and zig-zag with these effects: -0.06 +/- 0.04 where 80 to 100 % of the rate was reached, -0.01 +/- 0.04
beyond. Wider than either, since a fit that leaves the falling speed out was 8 to 10 % off on a vehicle outside the ensemble."""
UNSEEN_SWAY_LOG_SD = 0.06
"""More where the fit put a sway mode below what the data could show: its share of the settled turn was never seen."""
STALL_LOG_SD = 0.04
"""More for a fin angle that was not flown: lift per angle falls by a few per cent before the stall, and by much after it."""


@dataclass(frozen=True, slots=True)
class ModelError:
    """Mean and standard deviation of log(true radius / predicted radius)."""

    mean: float
    sd: float

    def factors(self, count: int, seed: int) -> FloatArray:
        """Return draws (count,) of true over predicted."""
        return np.exp(self.mean + self.sd * np.random.default_rng(seed).standard_normal(count))


@dataclass(frozen=True, slots=True)
class DataCoverage:
    """How far the data went toward the turn, as shares (NaN where not known), and whether the speed was flown."""

    fin: float
    rate: float
    hold: float
    speed_flown: bool
    sway_settles: bool = True

    @property
    def missing(self) -> tuple[str, ...]:
        """Words for what was not reached; empty when all was."""
        short = {
            "fin": "a fin angle this large was not flown",
            "rate": "a yaw rate this high was not reached",
            "hold": "no turn was held long enough to settle",
        }
        words = [says for part, says in short.items() if not getattr(self, part) >= MIN_COVERED_SHARE]
        sway = () if self.sway_settles else ("the model's sway settles more slowly than any turn was held",)
        return (*words, *sway, *(() if self.speed_flown else ("this speed was not flown",)))


def data_coverage(
    trained: Mapping[str, float], *, fin: float, rate: float, quarter_s: float, speed_flown: bool, sway_settles: bool = True
) -> DataCoverage:
    """Return the reach of what a model was trained on toward a turn at `fin` rad, `rate` rad/s, 90 deg after quarter_s."""
    nan = float("nan")
    return DataCoverage(
        fin=trained.get("fin_max", nan) / fin,
        rate=trained.get("rate_max", nan) / rate if rate > 0 else nan,
        hold=trained.get("held_s", nan) / quarter_s if quarter_s > 0 else nan,
        speed_flown=speed_flown,
        sway_settles=sway_settles,
    )


def model_error(effects: Iterable[Effect], reach: DataCoverage, *, formula: bool) -> ModelError:
    """Return the model error of a radius, the less the further the data reached.

    `formula` is the u-turn formula (speed kept, ramps counted in), else the settled circle. Where the reach is not known
    (a table), it is taken as a short pulse's. What a steady turn adds to that is a cross state and a damping that grows with the
    rate.
    """
    rate = 1.0 - _share(reach.rate, unknown=0.6)
    hold = 1.0 - _share(reach.hold, unknown=0.3)
    fin = 1.0 - _share(reach.fin, unknown=0.5)
    spread = 0.10 * max(rate, hold) + STALL_LOG_SD * fin
    if formula:
        return ModelError(0.04 + 0.30 * rate + 0.05 * hold, 0.10 + spread)
    if not any(e.extra_states or e.limits_rate for e in effects):
        return ModelError(0.12 + 0.50 * rate + 0.10 * hold, 0.10 + spread)
    return ModelError(0.15 * max(rate, hold), STEADY_TURN_LOG_SD + spread + (0.0 if reach.sway_settles else UNSEEN_SWAY_LOG_SD))


def _share(value: float, *, unknown: float) -> float:
    return float(np.clip(value, 0.0, 1.0)) if np.isfinite(value) else unknown
