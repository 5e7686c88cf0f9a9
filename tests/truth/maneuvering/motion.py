"""The motion of a hull in surge, sway and yaw, with its pilot: fourth-order Runge-Kutta in fine steps, compiled."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from truth.maneuvering.hulls import STATIONS, Coefficients, Hull

FINE_S = 0.02
OPEN, HOLD, ZIGZAG = 0, 1, 2


@nb.njit(cache=True)
def _fin_force(slope, stall, angle, u, side):
    """Return the normal force of a fin at an angle, in a flow u ahead and `side` across; it saturates at the stall angle."""
    attack = angle - math.atan2(side, u)
    size = abs(attack) / stall
    return slope * (u * u + side * side) * attack / (1.0 + size**4) ** 0.25


@nb.njit(cache=True)
def slope(u, v, r, fin, thrust, gust, h, out):
    """Write the accelerations (3,) in surge, sway and yaw to `out`."""
    x, y, n = thrust - h.drag * u * abs(u), 0.0, gust
    x += h.centripetal_surge * v * r + h.coupling * r * r
    y -= h.centripetal_sway * u * r
    n -= h.centripetal_yaw * u * r + h.munk * u * v
    y -= h.lift * u * v
    n -= h.lift * h.lift_arm * u * v
    tail = -h.tail_mass * u * (v + h.tail_arm * r)
    y += tail
    n += tail * h.tail_arm
    for i in range(STATIONS):
        place = (i + 0.5) / STATIONS - 0.5
        across = v + place * h.length * r
        part = -h.section_drag * math.sqrt(1.0 - abs(2.0 * place) ** h.profile_power) * across * abs(across) * h.length / STATIONS
        y += part
        n += part * place * h.length
    side = v + h.fin_arm * r
    fixed = _fin_force(h.fixed_fin, h.stall, 0.0, u, side)
    normal = _fin_force(h.rudder, h.stall, fin + h.rudder_offset, u, side)
    x -= normal * math.sin(fin)
    y += fixed + normal * math.cos(fin)
    n += h.fin_arm * (fixed + normal * math.cos(fin))
    det = h.mass_sway * h.inertia_yaw - h.coupling * h.coupling
    out[0] = x / h.mass_surge
    out[1] = (h.inertia_yaw * y - h.coupling * n) / det
    out[2] = (h.mass_sway * n - h.coupling * y) / det


@nb.njit(cache=True)
def whole(s, fin, push, straight, gust, h, out):
    thrust = push * (1.0 + h.thrust_slope * (1.0 - s[0] / straight))
    slope(s[0], s[1], s[2], fin, thrust, gust, h, out)
    out[3] = s[2]
    out[4] = s[0] * math.cos(s[3]) - s[1] * math.sin(s[3])
    out[5] = s[0] * math.sin(s[3]) + s[1] * math.cos(s[3])


@nb.njit(cache=True)
def fly(h, straight, command, mode, settings, sample, gust):
    """Return the states (n, 6) surge, sway, rate, heading, x, y, and the fin commands (n,), at samples of `sample` s.

    mode (n,): the open-loop command (OPEN), a pilot who keeps the course (HOLD), or the zig-zag rule (ZIGZAG), which reverses
    the fin when the heading reaches settings[1]. settings: zig-zag fin, zig-zag heading, limit, the pilot's two gains.
    """
    count = command.size
    states, given = np.zeros((count, 6)), np.zeros(count)
    push = h.drag * straight * straight
    k, s, mid = np.zeros((4, 6)), np.zeros(6), np.zeros(6)
    s[0] = straight
    fin, course, side, last = -h.rudder_offset, 0.0, 1.0, -1
    pieces = round(sample / FINE_S)
    step = sample / pieces
    for i in range(count):
        states[i] = s
        if mode[i] != last and mode[i] == HOLD:
            course = s[3] if last >= 0 and mode[i - 1] == OPEN else 0.0
        last = mode[i]
        asked = command[i]
        if mode[i] == HOLD:
            asked = settings[3] * (s[3] - course) + settings[4] * s[2]
        elif mode[i] == ZIGZAG:
            if side * s[3] < -settings[1]:
                side = -side
            asked = side * settings[0]
        asked = min(max(asked, -settings[2]), settings[2])
        given[i] = asked
        for _ in range(pieces):
            move = (asked - fin) / h.servo_lag
            fin += step * min(max(move, -h.rate_limit), h.rate_limit)
            for stage in range(4):
                reach = 0.0 if stage == 0 else (step if stage == 3 else 0.5 * step)
                for j in range(6):
                    mid[j] = s[j] + (reach * k[stage - 1, j] if stage else 0.0)
                whole(mid, fin, push, straight, gust[i], h, k[stage])
            for j in range(6):
                s[j] += step / 6.0 * (k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j])
    return states, given


def true_turn(hull: Hull, speed: float, side: float) -> tuple[float, float, float, float]:
    """Return radius (m), yaw rate (rad/s), surge and sway (m/s) of the steady circle at the rudder's limit.

    All are NaN where the motion does not settle within 400 lengths.
    """
    h: Coefficients = hull.of
    count = round(max(400.0 * h.length / speed, 200.0) / 0.2)
    command = np.full(count, -side * hull.rudder_limit)
    settings = np.array([0.0, 0.0, hull.rudder_limit, 0.0, 0.0])
    states, _ = fly(h, speed, command, np.full(count, OPEN), settings, 0.2, np.zeros(count))
    u, v, r = states[-1, :3]
    if not np.isfinite(states).all() or np.ptp(states[-count // 8 :, 2]) > 0.01 * abs(r) or side * r <= 0.0 or u < 0.05 * speed:
        return (float("nan"),) * 4
    return float(np.hypot(u, v) / abs(r)), float(r), float(u), float(v)
