"""A hull steered by a schedule, with a control law written independently of the package: gains interpolated over speed."""

from __future__ import annotations

import numba as nb
import numpy as np

from truth.maneuvering.hulls import Hull
from truth.maneuvering.motion import FINE_S, whole

LEAD_S = 30.0
"""Duration of the straight leg before the step."""


def steered(hull: Hull, speed: float, table: np.ndarray, step: float, seconds: float, latency: float = 0.0) -> np.ndarray:
    """Return time (s after the step), heading (rad), fin command (rad) and surge (m/s), (n, 4), of a course step (rad).

    table (k, 7): speed, kp, ki, kd, feed-forward, reference gain, fin limit. The hull starts on a straight course at `speed`.
    """
    count = round((LEAD_S + seconds) / FINE_S)
    out = np.zeros((count, 4))
    _steer(hull.of, speed, np.ascontiguousarray(table), step, round(latency / FINE_S), out)
    return out[round(LEAD_S / FINE_S) :] - np.array([LEAD_S, 0.0, 0.0, 0.0])


@nb.njit(cache=True)
def _steer(h, speed, table, step, late, out):
    push = h.drag * speed * speed
    k, s, mid, g = np.zeros((4, 6)), np.zeros(6), np.zeros(6), np.zeros(table.shape[1])
    s[0], fin, integral = speed, -h.rudder_offset, 0.0
    for i in range(out.shape[0]):
        for j in range(table.shape[1]):
            g[j] = np.interp(s[0], table[:, 0], table[:, j])
        wanted = step if i * FINE_S >= LEAD_S else 0.0
        asked = g[1] * (wanted - s[3]) + g[2] * integral - g[3] * s[2] + g[4] + g[5] * wanted
        given = min(max(asked, -g[6]), g[6])
        if given == asked or (asked - given) * g[1] * (wanted - s[3]) <= 0.0:
            integral += (wanted - s[3]) * FINE_S
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = i * FINE_S, s[3], given, s[0]
        command = out[i - late, 2] if i >= late else out[0, 2]
        move = (command - fin) / h.servo_lag
        fin += FINE_S * min(max(move, -h.rate_limit), h.rate_limit)
        for stage in range(4):
            reach = 0.0 if stage == 0 else (FINE_S if stage == 3 else 0.5 * FINE_S)
            for j in range(6):
                mid[j] = s[j] + (reach * k[stage - 1, j] if stage else 0.0)
            whole(mid, fin, push, speed, 0.0, h, k[stage])
        for j in range(6):
            s[j] += FINE_S / 6.0 * (k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j])
