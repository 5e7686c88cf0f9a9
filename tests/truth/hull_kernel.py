"""Six-degree-of-freedom equations of motion (Prestero 2001, equations 6.1 to 6.6), fine steps, compiled."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from truth.fin_path import fin_step

U, V, W, P, Q, R, X, Y, Z, PHI, THETA, PSI = range(12)


@nb.njit(cache=True)
def loads(s, h, rudder, elevator, thrust, out):
    """Write the forces and moments (6,), without the added-mass terms in the accelerations, to `out`."""
    u, v, w, p, q, r = s[U], s[V], s[W], s[P], s[Q], s[R]
    m, zg, light = h.W / h.g, h.zg, h.W - h.B
    sin_t, cos_t, sin_f, cos_f = math.sin(s[THETA]), math.cos(s[THETA]), math.sin(s[PHI]), math.cos(s[PHI])
    out[0] = -light * sin_t + h.Xuu * u * abs(u) + (h.Xwq - m) * w * q + h.Xqq * q * q + (h.Xvr + m) * v * r
    out[0] += h.Xrr * r * r - m * zg * p * r + thrust
    out[1] = light * cos_t * sin_f + h.Yvv * v * abs(v) + h.Yrr * r * abs(r) + h.Yuv * u * v + (h.Ywp + m) * w * p
    out[1] += (h.Yur - m) * u * r - m * zg * q * r + h.Ypq * p * q + h.Yuudr * u * u * rudder
    out[2] = light * cos_t * cos_f + h.Zww * w * abs(w) + h.Zqq * q * abs(q) + h.Zuw * u * w + (h.Zuq + m) * u * q
    out[2] += (h.Zvp - m) * v * p + m * zg * (p * p + q * q) + h.Zrp * r * p + h.Zuuds * u * u * elevator
    out[3] = -zg * h.W * cos_t * sin_f + h.Kpp * p * abs(p) - (h.Izz - h.Iyy) * q * r - m * zg * w * p + m * zg * u * r
    out[3] += h.Kprop * thrust
    out[4] = -zg * h.W * sin_t + h.Mww * w * abs(w) + h.Mqq * q * abs(q) + (h.Mrp - (h.Ixx - h.Izz)) * r * p
    out[4] += m * zg * v * r - m * zg * w * q + h.Muq * u * q + h.Muw * u * w + h.Mvp * v * p + h.Muuds * u * u * elevator
    out[5] = h.Nvv * v * abs(v) + h.Nrr * r * abs(r) + h.Nuv * u * v + (h.Npq - (h.Iyy - h.Ixx)) * p * q
    out[5] += h.Nwp * w * p + h.Nur * u * r + h.Nuudr * u * u * rudder


@nb.njit(cache=True)
def hull_slope(s, h, minv, rudder, elevator, thrust, water, gust, load, out):
    """Write the time derivative (12,) of the state to `out`.

    u, v, w are velocities through the water; `water` (3,) is the current in NED, in m/s.
    """
    loads(s, h, rudder, elevator, thrust, load)
    load[4] += gust[0]
    load[5] += gust[1]
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += minv[i, j] * load[j]
        out[i] = total
    sf, cf, st, ct = math.sin(s[PHI]), math.cos(s[PHI]), math.sin(s[THETA]), math.cos(s[THETA])
    sp, cp = math.sin(s[PSI]), math.cos(s[PSI])
    u, v, w = s[U], s[V], s[W]
    out[X] = cp * ct * u + (cp * st * sf - sp * cf) * v + (sp * sf + cp * cf * st) * w + water[0]
    out[Y] = sp * ct * u + (cp * cf + sf * st * sp) * v + (st * sp * cf - cp * sf) * w + water[1]
    out[Z] = -st * u + ct * sf * v + ct * cf * w + water[2]
    out[PHI] = s[P] + (sf * s[Q] + cf * s[R]) * st / ct
    out[THETA] = cf * s[Q] - sf * s[R]
    out[PSI] = (sf * s[Q] + cf * s[R]) / ct


@nb.njit(cache=True)
def hull_advance(s, h, minv, fins, commands, memory, thrust, water, gust, step, count):
    """Advance the state by `count` fine steps, (rudder, elevator) commands held constant, and return the fins' last angles.

    `memory` (2, 5) is that of the two fins' paths, whose coefficients are the same (`fins`).
    """
    k, load, mid = np.zeros((4, 12)), np.zeros(6), np.zeros(12)
    rudder, elevator = 0.0, 0.0
    for _ in range(count):
        rudder, elevator = fin_step(memory[0], commands[0], step, fins), fin_step(memory[1], commands[1], step, fins)
        hull_slope(s, h, minv, rudder, elevator, thrust, water, gust, load, k[0])
        for stage in range(1, 4):
            reach = step if stage == 3 else 0.5 * step
            for i in range(12):
                mid[i] = s[i] + reach * k[stage - 1, i]
            hull_slope(mid, h, minv, rudder, elevator, thrust, water, gust, load, k[stage])
        for i in range(12):
            s[i] += step / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
    return rudder, elevator
