"""The compiled closed loop of a vehicle in surge, sway and yaw by the midpoint rule, its fin limited in angle and rate."""

from __future__ import annotations

import math

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit
from fieldsid.schedule.flown.closed_loop_kernel import DIVERGED_RATE_RAD_S, fin_command, gains_at, steady_state
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
    """Fill out (n, t, 4) with heading, fin command, depth (zero) and surge of hulls (n, 22) under the gains of table (k, 8).

    settings (n, 5): the sign of the fin (1 if positive turns to port as in the equations, else -1), its offset (rad), lag (s),
    largest rate (rad/s), delay (s). push (t,) is a disturbance moment in rad/s^2. A loop starts from its steady state on a
    straight run at `speed` m/s. From the sample at which a vehicle diverges on its heading is inf.
    """
    now = np.empty(table.shape[1])
    for case in range(hulls.shape[0]):
        p = hulls[case].copy()
        sign, lag, most, late = settings[case, 0], settings[case, 2], settings[case, 3], settings[case, 4] / step
        p[OFFSET] = sign * settings[case, 1]
        keep, half = math.exp(-step / lag), math.exp(-0.5 * step / lag)
        full_steps = int(late)
        lift = rudder_lift(p, speed)
        gains_at(table, speed, now)
        y, integral, start = steady_state(0.0, 1.0, settings[case, 1], now)
        fin, u, v, r = start, speed, 0.0, 0.0
        for i in range(out.shape[1]):
            out[case, i, 0], out[case, i, 2], out[case, i, 3] = y, 0.0, u
            if not abs(r) < DIVERGED_RATE_RAD_S:
                out[case, i:, 0] = np.inf
                break
            gains_at(table, u, now)
            command, integral = fin_command(now, reference, y, r, integral, step)
            out[case, i, 1] = command
            newer = out[case, i - full_steps, 1] if i >= full_steps else start
            older = out[case, i - full_steps - 1, 1] if i > full_steps else start
            delayed = newer + (late - full_steps) * (older - newer)
            between = fin + min(max((delayed - fin) * (1.0 - half), -0.5 * step * most), 0.5 * step * most)
            du, dv, dr = slope(u, v, r, sign * fin, 1.0, speed, lift, p)
            mu, mv, mr = u + 0.5 * step * du, v + 0.5 * step * dv, r + 0.5 * step * (dr + push[i])
            du, dv, dr = slope(mu, mv, mr, sign * between, 1.0, speed, lift, p)
            y += step * mr
            u, v, r = max(u + step * du, LEAST_SURGE_M_S), v + step * dv, r + step * (dr + push[i])
            fin += min(max((delayed - fin) * (1.0 - keep), -step * most), step * most)
