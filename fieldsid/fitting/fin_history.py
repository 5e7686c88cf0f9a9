"""What the fin has done of late, in block means: what a motion, or what a model leaves of one, may follow."""

from __future__ import annotations

import numpy as np

from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.block_means import block_means, block_width
from fieldsid.numerics.first_order_lag import held_first_order_lag

MEMORY_TIME_CONSTANTS_S = (0.3, 1.0, 3.0, 10.0, 30.0)
"""Time constants through which the fin may have left its mark, as far as the record is eight times as long."""
BLOCK_S = 0.25


def fin_history(record: Record) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return block means (m,) of the fin about its mean, now and up to three blocks before, and through ever slower lags."""
    fin = blocks_of(record.fin - record.fin.mean(), record)
    length = float(record.time[-1] - record.time[0])
    lags = [np.concatenate([np.zeros(k), fin[: fin.size - k]]) for k in range(4)]
    return lags, [_lagged(fin, tau) for tau in MEMORY_TIME_CONSTANTS_S if 8.0 * tau < length]


def columns_of(record: Record, rate: FloatArray) -> FloatArray:
    """Return what a missing effect could follow, block means (m, p) scaled to one: fin, its history, rate, a constant."""
    lags, slow = fin_history(record)
    speed = blocks_of(rate, record)
    parts = [*lags, *slow, *(v * np.abs(v) for v in (lags[0], *slow, speed)), speed, np.ones(speed.size)]
    return np.column_stack([v / max(float(np.max(np.abs(v))), 1e-12) for v in parts])


def share_of_fin(record: Record) -> float:
    """Return the share (0..1) of the turning's power that follows the fin's history, as large as the data allow.

    The turning is the rate, or the slope of the angle where no rate was measured; slower than a block, about its mean.
    """
    by_rate = bool(record.rate_ok.any())
    values, ok = (record.rate, record.rate_ok) if by_rate else (record.angle, record.angle_ok)
    motion = blocks_of(np.interp(record.time, record.time[ok], values[ok]), record)
    if motion.size < 2:
        return 1.0
    motion = motion if by_rate else np.diff(motion, prepend=motion[0])
    lags, slow = fin_history(record)
    columns = np.column_stack([*lags, *slow, np.ones(motion.size)])
    centred = motion - motion.mean()
    power = float(centred @ centred)
    if motion.size <= columns.shape[1] or not power > 0.0:
        return 1.0
    left = motion - columns @ np.linalg.lstsq(columns, motion, rcond=1e-9)[0]
    return 1.0 - float(left @ left) / power


def _lagged(values: FloatArray, tau: float) -> FloatArray:
    """Return block means (m,) through a first-order lag of time constant tau in s, from zero."""
    return held_first_order_lag(values, np.full(values.size, np.exp(-BLOCK_S / tau)), 0.0)[1:]


def blocks_of(values: FloatArray, record: Record) -> FloatArray:
    """Return means (m,) over blocks of BLOCK_S."""
    return block_means(values, block_width(record.steps, BLOCK_S))
