"""The filtered equation of motion: a linear regression for the base parameters without differentiating noise.

With the rate measured, through lambda/(s + lambda):      p'_f = -a p_f - k y_f + b delta_f + C 1_f + p0 exp(-lambda t)
With the angle alone, through lambda^2/(s + lambda)^2:    y''_f = -a y'_f - k y_f + b delta_f + C 1_f + start terms
The filter's states give the derivatives: p'_f = lambda (p - lambda x1), y''_f = lambda^2 (y - 2 lambda x1 + lambda^2 x2).
The start terms take up the initial values, so that none has to be known. Source: the paper, estimator 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.errors import DataError
from fieldsid.fitting.regression.state_variable_filter import filtered
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

MAX_BRIDGED_GAP_S = 0.3
"""Longest gap in the measurement that is bridged; after a longer one, rows are left out until the filter has forgotten it."""
FORGET_TIME_CONSTANTS = 3.0
"""Filter time constants after which the samples before a gap no longer matter."""


@dataclass(frozen=True, slots=True)
class RegressionParameters:
    """Base parameters at a run's speed: damping 1/s, stiffness 1/s^2, authority 1/s^2, trim rad/s^2."""

    damping: float
    stiffness: float
    authority: float
    trim: float


@dataclass(frozen=True, slots=True)
class Measured:
    """Gap-free signals of one record (n,): angle rad, rate rad/s; `order` 1 where the rate is used, else 2; rows to use."""

    angle: FloatArray
    rate: FloatArray
    order: int
    use: npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Equation:
    """Rows of the regression: columns (m, 4) of damping, stiffness, authority, trim; start terms (m, order); target (m,)."""

    columns: FloatArray
    start: FloatArray
    target: FloatArray
    time: FloatArray


def measured_signals(record: Record, bandwidth: float) -> Measured:
    """Return the signals of a record for the filter; raises DataError where neither angle nor rate covers it."""
    rate_share, angle_share = float(record.rate_ok.mean()), float(record.angle_ok.mean())
    order = 1 if rate_share > 0.0 and rate_share >= 0.5 * angle_share else 2
    ok = record.rate_ok if order == 1 else record.angle_ok
    if not ok.any():
        raise DataError(f"run {record.name!r} has no measured angle or rate", hint="map one of them on import")
    rate = _bridged(record.time, record.rate, record.rate_ok)
    if record.angle_ok.any():
        angle = _bridged(record.time, record.angle, record.angle_ok)
    else:
        angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * record.steps)])
    return Measured(angle, rate, order, _usable(record.time, ok, FORGET_TIME_CONSTANTS * order / bandwidth))


def filtered_equation(record: Record, signals: Measured, bandwidth: float, theta: RegressionParameters | None = None) -> Equation:
    """Return the regression of one record; theta, where known, gives the curvature between samples.

    Without it measurements are straight between samples: a bias of about (a h)^2 / 12, 0.1 % at 20 Hz.
    """
    if signals.order == 1:
        return _by_rate(record, signals, bandwidth, theta)
    return _by_angle(record, signals, bandwidth, theta)


def _by_rate(record: Record, signals: Measured, bandwidth: float, theta: RegressionParameters | None) -> Equation:
    h, path, p, y = record.steps, record.commanded, signals.rate, signals.angle
    bend = turn = None
    if theta is not None:
        turn = np.diff(p) / h
        bend = -theta.damping * turn - theta.stiffness * np.diff(y) / h + theta.authority * (path.end - path.start) / h
    x_p = filtered(h, p[:-1], p[1:], bandwidth, bend)[:, 0]
    x_y = filtered(h, y[:-1], y[1:], bandwidth, turn)[:, 0]
    x_d = filtered(h, path.start, path.end, bandwidth)[:, 0]
    fade = np.exp(-bandwidth * (record.time - record.time[0]))
    columns = np.column_stack([-bandwidth * x_p, -bandwidth * x_y, bandwidth * x_d, 1.0 - fade])
    target = bandwidth * (p - bandwidth * x_p)
    use = signals.use
    return Equation(columns[use], fade[use, None], target[use], record.time[use])


def _by_angle(record: Record, signals: Measured, bandwidth: float, theta: RegressionParameters | None) -> Equation:
    h, path, y, power = record.steps, record.commanded, signals.angle, bandwidth**2
    bend = None
    if theta is not None:
        middle = 0.5 * (y[1:] + y[:-1])
        bend = -theta.damping * np.diff(y) / h - theta.stiffness * middle + theta.authority * path.mean + theta.trim
    x_y = filtered(h, y[:-1], y[1:], bandwidth, bend)
    x_d = filtered(h, path.start, path.end, bandwidth)[:, 1]
    span = bandwidth * (record.time - record.time[0])
    fade = np.exp(-span)
    slope = x_y[:, 0] - bandwidth * x_y[:, 1]
    columns = np.column_stack([-power * slope, -power * x_y[:, 1], power * x_d, 1.0 - fade * (1.0 + span)])
    target = power * (y - 2.0 * bandwidth * x_y[:, 0] + power * x_y[:, 1])
    use = signals.use
    return Equation(columns[use], np.column_stack([fade, span * fade])[use], target[use], record.time[use])


def _bridged(time: FloatArray, values: FloatArray, ok: npt.NDArray[np.bool_]) -> FloatArray:
    if not ok.any():
        return np.zeros_like(values)
    return np.interp(time, time[ok], values[ok])


def _usable(time: FloatArray, ok: npt.NDArray[np.bool_], forget_s: float) -> npt.NDArray[np.bool_]:
    """Return the rows that were measured and do not follow closely on a long gap."""
    use = ok.copy()
    after = time[ok][1:][np.diff(time[ok]) > MAX_BRIDGED_GAP_S]
    for end in after:
        use &= (time < end) | (time > end + forget_s)
    return use
