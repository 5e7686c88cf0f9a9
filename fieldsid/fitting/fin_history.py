"""What the fin has done of late, in block means: what a motion, or what a model leaves of one, may follow."""

from __future__ import annotations

import numpy as np

from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

MEMORY_TIME_CONSTANTS_S = (0.3, 1.0, 3.0, 10.0, 30.0)
"""Time constants through which the fin may have left its mark, as far as the record is eight times as long."""
BLOCK_S = 0.25


def fin_history(record: Record) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return block means (m,) of the fin about its mean, now and up to three blocks before, and through ever slower lags."""
    fin = block_means(record.fin - record.fin.mean(), record, BLOCK_S)
    length = float(record.time[-1] - record.time[0])
    lags = [np.concatenate([np.zeros(k), fin[: fin.size - k]]) for k in range(4)]
    return lags, [_fading_mean(fin, tau) for tau in MEMORY_TIME_CONSTANTS_S if 8.0 * tau < length]


def columns_of(record: Record, rate: FloatArray) -> FloatArray:
    """Return what a missing effect could follow, block means (m, p) scaled to one: fin, its history, rate, a constant."""
    lags, slow = fin_history(record)
    speed = block_means(rate, record, BLOCK_S)
    parts = [*lags, *slow, *(v * np.abs(v) for v in (lags[0], *slow, speed)), speed, np.ones(speed.size)]
    return np.column_stack([v / max(float(np.max(np.abs(v))), 1e-12) for v in parts])


def share_of_fin(record: Record) -> float:
    """Return the share (0..1) of the turning's power that follows the fin's history, as large as the data allow.

    The turning is the rate, or the slope of the angle where no rate was measured; slower than a block, about its mean.
    """
    by_rate = bool(record.rate_ok.any())
    values, ok = (record.rate, record.rate_ok) if by_rate else (record.angle, record.angle_ok)
    motion = block_means(np.interp(record.time, record.time[ok], values[ok]), record, BLOCK_S)
    motion = motion if by_rate else np.diff(motion, prepend=motion[0])
    lags, slow = fin_history(record)
    columns = np.column_stack([*lags, *slow, np.ones(motion.size)])
    centred = motion - motion.mean()
    power = float(centred @ centred)
    if motion.size <= columns.shape[1] or not power > 0.0:
        return 1.0
    left = motion - columns @ np.linalg.lstsq(columns, motion, rcond=1e-9)[0]
    return 1.0 - float(left @ left) / power


def _fading_mean(values: FloatArray, tau: float) -> FloatArray:
    """Return block means (m,) through a first-order lag of time constant tau."""
    keep, out, last = float(np.exp(-BLOCK_S / tau)), np.empty_like(values), 0.0
    for i, value in enumerate(values.tolist()):
        out[i] = last = keep * last + (1.0 - keep) * value
    return out


def block_means(values: FloatArray, record: Record, seconds: float) -> FloatArray:
    """Return means (m,) over blocks of so many seconds: white sensor noise falls, colour stays."""
    width = max(1, round(seconds / float(np.median(record.steps))))
    count = values.size // width
    return np.asarray(values[: count * width].reshape(count, width).mean(axis=1))
