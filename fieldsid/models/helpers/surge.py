"""The measured surge without its noise: what thrust and fin have made of it, and what is left smoothed.

    T u' + u = c thrust + d sqrt(thrust) + f delta^2,   measured: u + a + b t + the rest
A hull gathers way behind its propeller by a time T, in s, and loses it by the fin's own drag. These are known far better than
the speed: what follows them need not be smoothed. What it loses by turning is smoothed: the measured rate is an output of the
motion, and its noise must not come back through an input. Steady speed goes with the root of a thrust and with a propeller's
speed itself.
Source: Fossen 2011, section 6.4 (the surge mode of manoeuvring).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.first_order_lag import first_order_lag
from fieldsid.numerics.gcv_smoother import gcv_smooth

TIME_CONSTANTS_S = np.geomspace(0.5, 20.0, 12)


def surge_behind(time: FloatArray, surge: FloatArray, causes: Sequence[FloatArray], *, fastest_s: float) -> FloatArray:
    """Return the surge (n,) m/s at times (n,) s without its noise, beside causes (n,) each.

    T of the smoother is at least fastest_s s.
    """
    steps, since = np.diff(time), time - time[0]
    columns = (
        np.column_stack([*(first_order_lag(steps, cause, lag) for cause in causes), np.exp(-since / lag)])
        for lag in TIME_CONSTANTS_S.tolist()
    )
    return gcv_smooth(time, surge, fastest_s=fastest_s, beside=columns)


def causes_of(thrust: FloatArray | None, fin: FloatArray) -> list[FloatArray]:
    """Return what may move a hull's surge, (n,) each: of its thrust in any unit and its fin angle."""
    return [*([] if thrust is None else [thrust, np.sqrt(np.abs(thrust)) * np.sign(thrust)]), fin**2]
