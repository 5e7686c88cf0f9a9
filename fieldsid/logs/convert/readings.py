"""Tables of one row a reading: most cells are blank, and each signal has a clock of its own in the rows that have its number.

A table of one row for all has them too where a sensor is slower or fails; there what the slower one has stands beside the
faster one's number. Here it does not: no clock is that of the rows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldsid.logs.channels import ATTITUDE
from fieldsid.logs.convert.clock import ANGLES_AND_RATES
from fieldsid.logs.reader import RawLog, Series
from fieldsid.numerics.arrays import BoolArray

BESIDE = 0.5
"""Share of a signal's numbers beside which the fastest angle or rate has one, below which it has rows of its own."""


def by_reading(raw: RawLog) -> RawLog:
    """Return a table of one row a reading as signals on clocks of their own; any other log as it is."""
    seen = {signal: _seen(series) for signal, series in raw.series.items()}
    filled = {signal: rows for signal, rows in seen.items() if rows.any()}
    if not raw.one_clock or not filled or all(rows.all() for rows in filled.values()):
        return raw
    base = max([s for s in (ATTITUDE, *ANGLES_AND_RATES) if s in filled] or filled, key=lambda s: int(filled[s].sum()))
    if all((rows & filled[base]).sum() >= BESIDE * rows.sum() for rows in filled.values()):
        return raw
    series = {
        s: replace(raw.series[s], time=raw.series[s].time[rows], values=raw.series[s].values[rows]) for s, rows in filled.items()
    }
    return replace(raw, series=series, one_clock=False)


def _seen(series: Series) -> BoolArray:
    """Return the rows (n,) with a number of a signal."""
    return np.asarray(np.isfinite(series.values.reshape(series.time.size, -1)).all(axis=1))
