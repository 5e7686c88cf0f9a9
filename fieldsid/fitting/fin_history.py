"""Regressors made of the fin's recent history, as block means: a motion, or the residual of a model, may depend on them."""

from __future__ import annotations

import numpy as np

from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.block_means import block_means, block_width
from fieldsid.numerics.first_order_lag import held_first_order_lag

MEMORY_TIME_CONSTANTS_S = (0.3, 1.0, 3.0, 10.0, 30.0)
"""Time constants of the first-order lags through which the fin may act; those above an eighth of the record are left out."""
BLOCK_S = 0.25


def fin_history(record: Record) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the fin about its mean, in block means (m,): delayed by 0 to 3 blocks, and through lags of rising time constant."""
    fin = blocks_of(record.fin - record.fin.mean(), record)
    length = float(record.time[-1] - record.time[0])
    lags = [np.concatenate([np.zeros(k), fin[: fin.size - k]]) for k in range(4)]
    return lags, [_lagged(fin, tau) for tau in MEMORY_TIME_CONSTANTS_S if 8.0 * tau < length]


def columns_of(record: Record, rate: FloatArray) -> FloatArray:
    """Return the regressors on which a missing effect may depend: fin, its history, rate and a constant.

    They are block means (m, p), each column scaled to a largest absolute value of one; signed squares are among them.
    """
    lags, slow = fin_history(record)
    speed = blocks_of(rate, record)
    parts = [*lags, *slow, *(v * np.abs(v) for v in (lags[0], *slow, speed)), speed, np.ones(speed.size)]
    return np.column_stack([v / max(float(np.max(np.abs(v))), 1e-12) for v in parts])


def share_of_fin(record: Record) -> float:
    """Return the share (0..1) of the power of the turning that a regression on the fin's history explains.

    The turning is the block mean of the rate about its mean, or the difference of those of the angle where no rate was measured.
    The share is 1 where the record has too few blocks for the regression.
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
    residual = motion - columns @ np.linalg.lstsq(columns, motion, rcond=1e-9)[0]
    return 1.0 - float(residual @ residual) / power


def _lagged(values: FloatArray, tau: float) -> FloatArray:
    """Return block means (m,) filtered by a first-order lag of time constant tau in s that starts at zero."""
    return held_first_order_lag(values, np.full(values.size, np.exp(-BLOCK_S / tau)), 0.0)[1:]


def blocks_of(values: FloatArray, record: Record) -> FloatArray:
    """Return means (m,) over blocks of BLOCK_S."""
    return block_means(values, block_width(record.steps, BLOCK_S))
