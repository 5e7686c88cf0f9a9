"""The measured depth without its noise: what pitch and speed have made of it, and what is left smoothed.

    z' = -u sin(theta) + w cos(theta),   T w' + w = x q + y delta,   measured: z + l theta + a + b t + the rest
The path that a hull points along is known far better than its depth: what follows it need not be smoothed. l is a pressure
sensor's distance from the centre of rotation; where no speed was measured it counts as steady.
Source: Fossen 2011, section 2.2 (kinematics of the vertical plane).
"""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.first_order_lag import first_order_lag
from fieldsid.numerics.gcv_smoother import gcv_smooth
from fieldsid.numerics.trapezoid import trapezoid_integral

TIME_CONSTANTS_S = np.geomspace(0.1, 20.0, 12)


def depth_along(
    time: FloatArray, depth: FloatArray, pitch: FloatArray, surge: FloatArray | None, fin: FloatArray, *, fastest_s: float
) -> FloatArray:  # fmt: skip
    """Return the depth (n,) m at times (n,) s without its noise, beside a pitch (n,) rad, a surge (n,) m/s and a fin (n,) rad.

    T of the smoother is at least fastest_s s.
    """
    steps = np.diff(time)
    path = trapezoid_integral(time, np.sin(pitch) if surge is None else surge * np.sin(pitch))
    # a heave behind the pitch rate has moved the hull by what is left of the pitch behind the same lag
    columns = (
        np.column_stack(
            [path, pitch, first_order_lag(steps, pitch, lag), trapezoid_integral(time, first_order_lag(steps, fin, lag))]
        )
        for lag in TIME_CONSTANTS_S.tolist()
    )
    return gcv_smooth(time, depth, fastest_s=fastest_s, beside=columns)
