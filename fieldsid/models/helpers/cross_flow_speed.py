"""The measured sway or heave without its noise: what turning and the fin do to it, and what is left smoothed.

    T v' + v = x r + y delta,   measured: v + z r + a + b t + the rest
A hull drifts as it turns, behind the rate by a time T, in s; z is what a sensor away from the reference point sees of the
rate itself. The rate is known far better than the sway: what follows it need not be smoothed.
Source: Fossen 2011, section 7.1 (the linear sway mode of manoeuvring).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.first_order_lag import first_order_lag
from fieldsid.numerics.gcv_smoother import gcv_smooth

TIME_CONSTANTS_S = np.geomspace(0.1, 20.0, 24)


def cross_speed(
    time: FloatArray, cross: FloatArray, rate: FloatArray, rate_ok: npt.NDArray[np.bool_], fin: FloatArray
) -> FloatArray:  # fmt: skip
    """Return the sway or heave (n,) m/s at times (n,) s without its noise, beside a rate rad/s that was measured where ok."""
    if not rate_ok.any():
        return gcv_smooth(time, cross)
    return gcv_smooth(time, cross, beside=_drifts(time, np.interp(time, time[rate_ok], rate[rate_ok]), fin))


def _drifts(time: FloatArray, rate: FloatArray, fin: FloatArray) -> Iterator[FloatArray]:
    """Yield for every T the columns (n, 4) that a turning hull's drift is a sum of."""
    steps, since = np.diff(time), time - time[0]
    return (
        np.column_stack([rate, first_order_lag(steps, rate, lag), first_order_lag(steps, fin, lag), np.exp(-since / lag)])
        for lag in TIME_CONSTANTS_S.tolist()
    )
