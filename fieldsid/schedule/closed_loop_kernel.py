"""The compiled closed loop: fin limited in angle and rate, lagging and delayed; the plant by the midpoint rule.

The integral is held while the fin is at its stop and the error would push it on (conditional integration).
"""

from __future__ import annotations

import numpy as np

from fieldsid.dynamics.nonlinear_kernel import power_drag
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit

PLANT_COLUMNS = 14
"""Columns of a plant's row: damping, stiffness, authority, offset, quadratic, beyond_square, crossflow, cross_damping,
cross_rate, cross_fin, cross_quadratic, exp(-step/lag), delay in steps, largest fin move in a step."""
LOOP_ENTRIES = 8
"""Entries of a loop: kp, ki, kd, bias, reference gain, fin limit, depth gain, pitch limit."""


@inner
def drag(p: float, of_power: float, beyond: float, square: float) -> float:
    """Return the drag at a rate: of_power p|p| (|p|/0.2)^beyond + square p|p|."""
    value = square * p * abs(p)
    return value if of_power == 0.0 else value + of_power * power_drag(p, beyond)[0]


@jit
def close_loop(
    plants: FloatArray, loop: FloatArray, reference: float, depth_step: float, speed: float, step: float, out: FloatArray
) -> None:
    """Fill out (n, t, 3) with angle, fin and depth of n plants (n, 14) under one loop (8,).

    With depth_step other than zero the reference is depth gain (z - depth_step), limited; else `reference` rad.
    """
    count = out.shape[1]
    for case in range(plants.shape[0]):
        a, k, b, offset = plants[case, 0], plants[case, 1], plants[case, 2], plants[case, 3]
        d, beyond, d_2 = plants[case, 4], plants[case, 5], plants[case, 6]
        c, c_r, c_f, c_q = plants[case, 7], plants[case, 8], plants[case, 9], plants[case, 10]
        decay, late, most = plants[case, 11], int(plants[case, 12]), plants[case, 13]
        if beyond == 0.0:
            d, d_2 = 0.0, d + d_2
        kp, ki, kd, bias, k_ref, limit = loop[0], loop[1], loop[2], loop[3], loop[4], loop[5]
        y = p = x = z = integral = 0.0
        start = min(max(bias, -limit), limit)
        fin = start
        h = 0.5 * step
        for i in range(count):
            out[case, i, 0], out[case, i, 1], out[case, i, 2] = y, fin, z
            target = reference
            if depth_step != 0.0:
                target = min(max(loop[6] * (z - depth_step), -loop[7]), loop[7])
            error = target - y
            wanted = kp * error + ki * integral - kd * p + bias + k_ref * target
            command = min(max(wanted, -limit), limit)
            if command == wanted or (wanted - command) * kp * error <= 0.0:
                integral += error * step
            # the fin sees the command of `late` steps ago; its own column of out holds what was commanded meanwhile
            if late > 0:
                out[case, i, 1] = command
                command = out[case, i - late, 1] if i >= late else start
            goal = command + (fin - command) * decay
            new = fin + min(max(goal - fin, -most), most)
            held = 0.5 * (fin + new) + offset
            py = p
            pp = -a * p - k * y + b * held - drag(p, d, beyond, d_2) + x
            px = -(c + c_q * abs(x)) * x - c_r * p + c_f * held
            ym, pm, xm = y + h * py, p + h * pp, x + h * px
            before = y
            y += step * pm
            p += step * (-a * pm - k * ym + b * held - drag(pm, d, beyond, d_2) + xm)
            x += step * (-(c + c_q * abs(xm)) * xm - c_r * pm + c_f * held)
            z -= speed * 0.5 * (before + y) * step
            fin = new


def compile_loops() -> None:
    """Call once, on a plant that does not move, what checking a schedule calls."""
    close_loop(np.zeros((1, PLANT_COLUMNS)), np.zeros(LOOP_ENTRIES), 0.0, 0.0, 1.0, 0.02, np.zeros((1, 2, 3)))
