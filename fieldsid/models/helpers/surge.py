"""The measured surge without its noise: the response to thrust and fin, plus a smooth remainder.

    T u' + u = c thrust + d sqrt(thrust) + f delta^2,   measured surge = u + a + b t + smooth remainder + noise
The surge follows the propeller with a time constant T (s), and the drag of the fin slows the hull. Thrust and fin are known far
better than the speed, so that the response to them need not be smoothed. The loss of speed in a turn is in the remainder: the
measured rate is an output of the motion, and its noise must not enter an input. The steady speed is proportional to the root of
a thrust, or to the speed of a propeller.
Source: Fossen 2011, section 6.4 (the surge mode of manoeuvring).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.first_order_lag import first_order_lag
from fieldsid.numerics.gcv_smoother import Smoother, gcv_smooth

TIME_CONSTANTS_S = np.geomspace(0.5, 20.0, 12)


def smoothed_surge(
    time: FloatArray, surge: FloatArray, causes: Sequence[FloatArray], *, fastest_s: float
) -> tuple[FloatArray, Smoother | None]:  # fmt: skip
    """Return the surge (n,) m/s at times (n,) s without its noise, and the smoother.

    `causes`, (n,) each, drive the surge through a first-order lag. The time constant of the smoother is at least `fastest_s` s.
    """
    steps, since = np.diff(time), time - time[0]
    columns = (
        np.column_stack([*(first_order_lag(steps, cause, lag) for cause in causes), np.exp(-since / lag)])
        for lag in TIME_CONSTANTS_S.tolist()
    )
    return gcv_smooth(time, surge, fastest_s=fastest_s, regressors=columns)


def causes_of(thrust: FloatArray | None, fin: FloatArray) -> list[FloatArray]:
    """Return the signals that may drive the surge, (n,) each: thrust (any unit), its signed root, and the square of the fin."""
    return [*([] if thrust is None else [thrust, np.sqrt(np.abs(thrust)) * np.sign(thrust)]), fin**2]
