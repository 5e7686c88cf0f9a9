"""Numbers of one free run against its measurement: Theil's coefficient, R^2 and the whiteness of the residual.

Theil U = rms(y - s) / (rms(y) + rms(s)), 0 perfect and 1 worst (Theil 1961); R^2 = 1 - |y - s|^2 / |y - mean(y)|^2, at most
1 and negative where the mean would do better. Angles are taken about their first value, so that neither number
depends on where north is. Whiteness is the p-value of Ljung and Box 1978.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fieldsid.fitting.predict.predict import Prediction
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.ljung_box import FEWEST_SAMPLES, ljung_box_p
from fieldsid.records.keys import Key, Number


@dataclass(frozen=True, slots=True)
class Metrics:
    """Theil's coefficient and R^2 of the channel that was judged, and the p-value of its residual being white."""

    theil: Annotated[Number, Key("Theil's inequality coefficient, 0 perfect, 1 worst.")]
    r2: Annotated[Number, Key("1 - |y - s|^2 / |y - mean y|^2.")]
    whiteness_p: Annotated[Number, Key("p-value of the residual being white.")]


def metrics(shown: Prediction, channel: int) -> Metrics:
    """Return the metrics of one channel of a prediction: 0 the angle, 1 the rate; NaN where it was not measured."""
    record = shown.record
    ok = record.ok[channel]
    measured = (record.angle, record.rate)[channel][ok]
    simulated = (shown.angle, shown.rate)[channel][ok]
    if measured.size < 2:
        return Metrics(float("nan"), float("nan"), float("nan"))
    zero = measured[0] if channel == 0 else 0.0
    return Metrics(theil(measured - zero, simulated - zero), r_squared(measured, simulated), whiteness_p(measured - simulated))


def theil(measured: FloatArray, simulated: FloatArray) -> float:
    """Return Theil's inequality coefficient in [0, 1]; 0 where both are zero throughout."""
    spread = _rms(measured) + _rms(simulated)
    return _rms(measured - simulated) / spread if spread > 0.0 else 0.0


def r_squared(measured: FloatArray, simulated: FloatArray) -> float:
    """Return the share of the measurement's variance that is explained, NaN for a constant measurement."""
    variance = float(np.mean((measured - measured.mean()) ** 2))
    return 1.0 - float(np.mean((measured - simulated) ** 2)) / variance if variance > 0.0 else float("nan")


def whiteness_p(residual: FloatArray) -> float:
    """Return the probability of a residual at least as coloured as this one if it were white; NaN when too short."""
    return ljung_box_p([residual]) if residual.size >= FEWEST_SAMPLES else float("nan")


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
