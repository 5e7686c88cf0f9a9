"""The compiled closed loop of a vehicle in surge, sway and yaw: its equations by the midpoint rule, the fin limited twice."""

from __future__ import annotations

import math

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit
from fieldsid.schedule.flown.closed_loop_kernel import DIVERGED_RATE_RAD_S, at_rest, commanded, gains_at
from fieldsid.turning.maneuvering.equations import LEAST_SURGE_M_S, OFFSET, rudder_lift, slope


@jit
def close_hull_loop(
    hulls: FloatArray,
    settings: FloatArray,
    table: FloatArray,
    reference: float,
    speed: float,
    step: float,
    push: FloatArray,
    out: FloatArray,
) -> None:
    """Fill out (n, t, 4) with heading, fin command, depth (nil) and surge of n vehicles (n, 22) under the gains of table (k, 8).

    settings (n, 5): which way the fin turns (1 to port as the equations' rudder, else -1), its offset (rad), lag (s), largest
    rate (rad/s), delay (s). push (t,) is a disturbance moment in rad/s^2; a loop starts from where it rests on a
    straight run at `speed` m/s. What diverges is inf from there on.
    """
    now = np.empty(table.shape[1])
    for case in range(hulls.shape[0]):
        p = hulls[case].copy()
        way, lag, most, late = settings[case, 0], settings[case, 2], settings[case, 3], settings[case, 4] / step
        p[OFFSET] = way * settings[case, 1]
        keep, half = math.exp(-step / lag), math.exp(-0.5 * step / lag)
        whole = int(late)
        lift = rudder_lift(p, speed)
        gains_at(table, speed, now)
        y, integral, start = at_rest(0.0, 1.0, settings[case, 1], now)
        fin, u, v, r = start, speed, 0.0, 0.0
        for i in range(out.shape[1]):
            out[case, i, 0], out[case, i, 2], out[case, i, 3] = y, 0.0, u
            if not abs(r) < DIVERGED_RATE_RAD_S:
                out[case, i:, 0] = np.inf
                break
            gains_at(table, u, now)
            command, integral = commanded(now, reference, y, r, integral, step)
            out[case, i, 1] = command
            newer = out[case, i - whole, 1] if i >= whole else start
            older = out[case, i - whole - 1, 1] if i > whole else start
            asked = newer + (late - whole) * (older - newer)
            between = fin + min(max((asked - fin) * (1.0 - half), -0.5 * step * most), 0.5 * step * most)
            du, dv, dr = slope(u, v, r, way * fin, 1.0, speed, lift, p)
            mu, mv, mr = u + 0.5 * step * du, v + 0.5 * step * dv, r + 0.5 * step * (dr + push[i])
            du, dv, dr = slope(mu, mv, mr, way * between, 1.0, speed, lift, p)
            y += step * mr
            u, v, r = max(u + step * du, LEAST_SURGE_M_S), v + step * dv, r + step * (dr + push[i])
            fin += min(max((asked - fin) * (1.0 - keep), -step * most), step * most)
