"""The estimate of a vehicle's parameters at one time of the flight."""

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
    """The estimate at `time` s: values and standard errors by parameter name, NaN before they exist.

    `used` is the number of rows in the estimate, `speed` the mean surge in m/s (NaN where unknown). `counts` are the numbers of
    missing, repeated and late samples, gaps, restarts of the clock and spikes. `contradiction` says in words how the last samples
    of angle and rate contradict each other, and is empty where they do not; with a wrong sign the values have no meaning.
    `covariance` (p, p) is in the order of the names, empty before there is one. `speed_now` is the mean surge of the last
    seconds, `fin_most` (rad) the largest fin. `jump` is the last jump of the fin's authority; the estimate uses the samples since
    then.
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
