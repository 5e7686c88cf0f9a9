"""The grid of times at which an event of a run is searched for: denser where the fin acts.

Where an event changes the fin's authority, a shift of its time changes the moment by b loss delta(t) in between, and the path by
the integral of that: nothing while the fin is at rest. Other changes by an event grow with the time that passes. The grid is
therefore uniform in the sum of both.
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

EVENT_TIMES = 41
"""Number of grid times over a run. Of 183 simulated data sets with a step change, one fit ends more than 0.5 above the cost of
the fit from the true values, with this number of times and with twice as many."""


def event_times(record: Record, count: int = EVENT_TIMES, low: float = 0.0, high: float = 1.0) -> FloatArray:
    """Return times (count,) from low to high, as shares of a run, at equal steps of the time plus the fin's action.

    The fin's action is the integral of its absolute deflection; both are normalised to one over the run.
    """
    share = (record.time - record.time[0]) / (record.time[-1] - record.time[0])
    deflection = np.abs(record.fin)
    action = np.concatenate([[0.0], np.cumsum(0.5 * (deflection[1:] + deflection[:-1]) * np.diff(share))])
    passed = share + action / action[-1] if action[-1] > 0.0 else share
    first, last = (float(np.interp(end, share, passed)) for end in (low, high))
    times = np.asarray(np.interp(np.linspace(first, last, count), passed, share))
    times[[0, -1]] = low, high
    return times
