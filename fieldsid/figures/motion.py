"""Measured against simulated motion of one run: angle, rate, fin and residual over time, one panel each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from fieldsid.figures.panel import Panel, Series
from fieldsid.models.axis import Axis
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.tail_probabilities import student_quantile

if TYPE_CHECKING:
    from fieldsid.fitting.predict.predict import Prediction
    from fieldsid.models.model import Noise
    from fieldsid.models.record import Record

SYMBOLS = {Axis.YAW: ("yaw", "yaw rate", "rudder"), Axis.PITCH: ("pitch", "pitch rate", "elevator")}
UNITS = ("deg", "deg/s")
TWO_SIDED_99 = student_quantile(0.995, 0)
"""Quantile 0.995 of the normal distribution: bands are those of 99 %."""
Shown: TypeAlias = "Sequence[tuple[str, str, Prediction]]"
"""Free runs over one record: of each its name, the kind of its lines, and the motion."""


def panels(shown: Shown, floor: Noise, spans: Sequence[tuple[float, float]] = ()) -> tuple[Panel, ...]:
    """Return the measured channels, the fin, and what is left of them over the noise floor; spans (s) are shaded."""
    record = shown[0][2].record
    channels = [channel(shown, i, spans) for i in (0, 1) if record.ok[i].any()]
    return (*channels, fin(shown[0][2], spans), residual(shown, floor, spans))


def channel(shown: Shown, index: int, spans: Sequence[tuple[float, float]] = (), title: str = "", x: str = "") -> Panel:
    """Return a channel, 0 the angle in deg, 1 the rate in deg/s, measured and by each model."""
    record = shown[0][2].record
    models = [Series(record.time, np.degrees((p.angle, p.rate)[index]), kind, name) for name, kind, p in shown]
    dots = Series(record.time, measured(record, index), "measured", "measured", "dots")
    return Panel(f"{SYMBOLS[record.axis][index]}, {UNITS[index]}", (dots, *models), height=125, spans=spans, x=x, title=title)


def measured(record: Record, index: int) -> FloatArray:
    """Return a measured channel (n,) in deg or deg/s, NaN where nothing was measured."""
    return np.degrees(np.where(record.ok[index], record.both[index], np.nan))


def fin(shown: Prediction, spans: Sequence[tuple[float, float]] = ()) -> Panel:
    """Return the logged fin in deg, and the fin angle that the model makes of it where the two differ."""
    record = shown.record
    name, form = "measured fin" if record.fin_is_measured else "command", "steps" if record.fin_is_held else "line"
    series = [Series(record.time, np.degrees(record.fin), "fin", name, form)]
    if np.max(np.abs(shown.fin[:-1] - record.fin[:-1])) > 1e-6:  # the last sample begins no interval
        series.append(Series(record.time, np.degrees(shown.fin), "second", "fin in the model"))
    return Panel(f"{SYMBOLS[record.axis][2]}, deg", series, height=80, spans=spans)


def residual(shown: Shown, floor: Noise, spans: Sequence[tuple[float, float]] = ()) -> Panel:
    """Return measured less simulated over the sensor's noise, with the 99 % band of the noise.

    Of one model that of angle and rate; of several that of each in the rate, or in the angle where no rate was measured.
    """
    record = shown[0][2].record
    known = [i for i in (0, 1) if record.ok[i].any() and (floor.angle, floor.rate)[i] > 0.0]
    lines = [(("angle", "rate")[i], ("third", "second")[i], i, shown[0][2]) for i in known]
    if len(shown) > 1:
        lines = [(name, kind, known[-1], p) for name, kind, p in shown if known]
    left = [
        (name, kind, (measured(record, i) - np.degrees((p.angle, p.rate)[i])) / np.degrees((floor.angle, floor.rate)[i]))
        for name, kind, i, p in lines
    ]
    series = [Series(record.time, values, kind, name, thin=True) for name, kind, values in left]
    of = "" if len(shown) == 1 or not known else f"{('angle', 'rate')[known[-1]]} "
    edges = level(record.time, TWO_SIDED_99, "99 % of the noise"), level(record.time, -TWO_SIDED_99)
    return Panel(f"{of}residual / noise", (*series, *edges), height=100, spans=spans, x="time, s")


def level(x: FloatArray, value: float, name: str = "", kind: str = "quiet") -> Series:
    """Return a dashed line at a value over the whole of an axis x (n,)."""
    return Series(np.array([np.min(x), np.max(x)]), np.full(2, value), kind, name, dashed=True)
