"""What is known of a vehicle under way at one time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, nan

import numpy as np

from fieldsid.errors import DataError
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import TRIM_OF_FIN, SpeedLaw
from fieldsid.online.authority_jump import Jump
from fieldsid.rounding import TWO_SIDED_95


@dataclass(frozen=True, slots=True)
class OnlineEstimate:
    """What is known at `time` s: values and standard errors by parameter name, NaN before they exist.

    `used` counts rows that joined the estimate, `speed` is the mean surge in m/s (NaN where unknown), `counts` what was met:
    missing, repeated and late samples, gaps, restarts of the clock, spikes. `contradiction` is how the last samples of angle and
    rate contradict each other, in words, empty where they do not: with a sign turned the values mean nothing. `covariance` (p, p)
    is in the order of the names, empty before there is one; `speed_now` the surge of the last seconds, `fin_most` (rad) the
    largest fin. `jump` is the last jump of the fin's authority: the estimate is of what came since.
    """

    axis: Axis
    time: float
    values: Mapping[str, float]
    std_errors: Mapping[str, float]
    used: int
    speed: float
    counts: Mapping[str, int]
    contradiction: str = ""
    covariance: tuple[tuple[float, ...], ...] = ()
    speed_now: float = nan
    fin_most: float = 0.0
    by_rate: bool = False
    jump: Jump | None = None

    @property
    def model(self) -> Model:
        """The estimate as a model without effects, at the mean speed; raises DataError before there is one."""
        if not self.covariance or not all(map(isfinite, self.values.values())):
            raise DataError("there is no estimate yet", found=f"{self.used} samples", hint="move the fin and go on")
        law, noise = SpeedLaw(self.speed, trim_of_fin=TRIM_OF_FIN[self.axis]), Noise(nan, nan)
        covariance = np.array(self.covariance)
        return Model(self.axis, (), self.values, {}, tuple(self.values), covariance, law, noise, method="live")

    @property
    def intervals95(self) -> dict[str, tuple[float, float]]:
        """The 95 % intervals under normal errors: values -+ 1.96 standard errors."""
        return {n: (v - TWO_SIDED_95 * self.std_errors[n], v + TWO_SIDED_95 * self.std_errors[n]) for n, v in self.values.items()}
