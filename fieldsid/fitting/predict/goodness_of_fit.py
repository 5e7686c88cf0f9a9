"""Goodness of fit of a free run: rms residual and fit of angle and rate, over one run or several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.predict.predict import Prediction
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Key, Number


@dataclass(frozen=True, slots=True)
class GoodnessOfFit:
    """Rms of the residual in rad and rad/s, and fit in per cent; NaN where the sensor is not in the log.

    fit = 100 (1 - |y - s| / |y - mean(y)|), y measured and s simulated; 100 is perfect, 0 no better than the mean.
    """

    angle_rms: Annotated[Number, Key("Of the angle, in rad.", "angle_rms_rad")]
    rate_rms: Annotated[Number, Key("Of the rate, in rad/s.", "rate_rms_rad_s")]
    angle_fit: Annotated[Number, Key("100 (1 - |y - s| / |y - mean y|) of the angle.", "angle_fit_percent")]
    rate_fit: Annotated[Number, Key("The same of the rate.", "rate_fit_percent")]


def goodness_of_fit(predictions: Sequence[Prediction]) -> GoodnessOfFit:
    """Return the goodness of fit of one run, or of several from their pooled residuals (each run about its mean)."""
    angle = [_sums(p.record.angle, p.angle, p.record.angle_ok) for p in predictions]
    rate = [_sums(p.record.rate, p.rate, p.record.rate_ok) for p in predictions]
    return GoodnessOfFit(_rms(angle), _rms(rate), _fit(angle), _fit(rate))


Sums = tuple[float, float, int]
"""Sum of squared residuals, sum of squares about the mean, count."""


def _sums(measured: FloatArray, simulated: FloatArray, ok: npt.NDArray[np.bool_]) -> Sums:
    y = measured[ok]
    if y.size == 0:
        return 0.0, 0.0, 0
    return float(np.sum((y - simulated[ok]) ** 2)), float(np.sum((y - y.mean()) ** 2)), int(y.size)


def _rms(parts: list[Sums]) -> float:
    count = sum(p[2] for p in parts)
    return float(np.sqrt(sum(p[0] for p in parts) / count)) if count else float("nan")


def _fit(parts: list[Sums]) -> float:
    spread = sum(p[1] for p in parts)
    return 100.0 * (1.0 - float(np.sqrt(sum(p[0] for p in parts) / spread))) if spread > 0.0 else float("nan")
