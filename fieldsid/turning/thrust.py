"""The thrust of a run over that of its straight start, by whatever tells it."""

from __future__ import annotations

import numpy as np

from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

RPM = "propeller_rpm"


def at_start(values: FloatArray) -> float:
    """Return the median of a signal (n,) over its first twentieth, of ten samples at least; NaN where it has none."""
    return float(np.median(values[: max(10, values.size // 20)])) if values.size else float("nan")


def thrust_ratio(record: Record) -> FloatArray:
    """Return the thrust (n,) over that at the run's start, one where it is not logged; it goes with the rpm squared."""
    thrust = record.signals.get("thrust")
    start = float("nan") if thrust is None else at_start(thrust)
    if thrust is None or not start > 0.0:
        return np.ones(len(record))
    ratio = np.maximum(thrust / start, 0.0)
    return np.asarray(ratio**2 if record.thrust_column == RPM else ratio)
