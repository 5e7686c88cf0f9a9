"""The compiled closed loop: fin limited in angle and rate, lagging and delayed; the plant by the midpoint rule.

The speed falls in the turn, u' = a_u (u0^2 - u^2 (1 + f delta^2) - t r^2), the plant's coefficients go with powers of u/u0, and
the gains are those of the schedule at that speed. The integral is held while the fin is at its stop and the error would push it
on (conditional integration). A loop starts from where it rests under the reference zero.
"""

from __future__ import annotations

import numpy as np

from fieldsid.dynamics.drag_laws import crossflow, crossforce, power_drag
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit

PLANT_COLUMNS = 26
"""Columns of a plant's row: damping, stiffness, authority, offset, quadratic, beyond_square, cross_damping, cross_rate,
cross_fin, cross_quadratic, exp(-step/lag), delay in steps, largest fin move in a step; the powers of the speed of
damping, authority, cross_damping, cross_rate, cross_fin, cross_quadratic; drag, fin's and turn's loss of speed; cross_share,
strip_moment, strip_force, strip_flow."""
GAIN_COLUMNS = 8
"""Columns of the gains' rows: speed, kp, ki, kd, bias, reference gain, fin limit, depth gain."""
OUT_COLUMNS = 4
"""Columns of the motion: angle, fin, depth, speed."""
DIVERGED_RATE_RAD_S = 20.0
SLOWEST_SHARE = 0.05


@inner
def drag(p: float, quadratic: float, beyond: float) -> float:
    """Return the drag at a rate: quadratic p|p| (|p|/0.2)^beyond."""
    return quadratic * (p * abs(p) if beyond == 0.0 else power_drag(p, beyond)[0])


@inner
def gains_at(table: FloatArray, speed: float, out: FloatArray) -> None:
    """Fill out (8,) with the gains at a speed: linear between the rows of table (k, 8), held beyond them."""
    last = table.shape[0] - 1
    below = 0
    while below < last - 1 and speed > table[below + 1, 0]:
        below += 1
    above = min(below + 1, last)
    width = table[above, 0] - table[below, 0]
    share = 0.0 if width <= 0.0 else min(max((speed - table[below, 0]) / width, 0.0), 1.0)
    for j in range(table.shape[1]):
        out[j] = table[below, j] + share * (table[above, j] - table[below, j])


@inner
def at_rest(row: FloatArray, now: FloatArray) -> tuple[float, float, float]:
    """Return angle, integral and fin of a loop that rests under the reference zero; those of its start where none can hold it."""
    limit, offset, stiff = now[6], row[3], row[1] + row[2] * now[1]
    if not abs(offset) < limit or stiff == 0.0:
        return 0.0, 0.0, min(max(now[4], -limit), limit)
    if now[2] != 0.0:
        return 0.0, -(now[4] + offset) / now[2], -offset
    angle = row[2] * (now[4] + offset) / stiff
    return angle, 0.0, min(max(now[4] - now[1] * angle, -limit), limit)


@inner
def at_speed(row: FloatArray, ratio: float, out: FloatArray) -> None:
    """Fill out (6,) with damping, authority and the cross state's four coefficients at a speed over the first one."""
    for j in range(6):
        value, power = row[0] if j == 0 else row[4 + j], row[13 + j]
        # a law's powers are whole but for a fitted one, and a product takes a tenth of the time
        factor = 1.0 if power == 0.0 else ratio if power == 1.0 else ratio * ratio if power == 2.0 else ratio**power
        out[j] = (row[2] if j == 1 else value) * factor


@inner
def commanded(now: FloatArray, target: float, y: float, p: float, integral: float, step: float) -> tuple[float, float]:
    """Return the fin's command and the integral after a step: held where the fin is at its stop and the error pushes it on."""
    error = target - y
    wanted = now[1] * error + now[2] * integral - now[3] * p + now[4] + now[5] * target
    command = min(max(wanted, -now[6]), now[6])
    if command == wanted or (wanted - command) * now[1] * error <= 0.0:
        integral += error * step
    return command, integral


@inner
def along_hull(row: FloatArray, c: FloatArray, x: float, p: float) -> tuple[float, float]:
    """Return the moment of the cross state with that of the flow it makes along the hull, and what that flow takes from it."""
    if row[23] == 0.0 and row[24] == 0.0:
        return row[22] * x, 0.0
    faster = c[2] / row[6]
    alpha = row[25] * x / faster
    return row[22] * x - row[23] * crossflow(alpha, p)[0], row[24] * faster * crossforce(alpha, p)[0]


@inner
def moved(
    row: FloatArray, c: FloatArray, held: float, push: float, step: float, state: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Return angle, rate and cross state after a step by the midpoint rule, and the rate midway."""
    y, p, x = state
    a, b, k, h, quadratic, beyond = c[0], c[1], row[1], 0.5 * step, row[4], row[5]
    moment = b * held + push
    turned, slowed = along_hull(row, c, x, p)
    pp = -a * p - k * y + moment - drag(p, quadratic, beyond) + turned
    px = -(c[2] + c[5] * abs(x)) * x - c[3] * p + c[4] * held - slowed
    ym, pm, xm = y + h * p, p + h * pp, x + h * px
    turned, slowed = along_hull(row, c, xm, pm)
    p += step * (-a * pm - k * ym + moment - drag(pm, quadratic, beyond) + turned)
    x += step * (-(c[2] + c[5] * abs(xm)) * xm - c[3] * pm + c[4] * held - slowed)
    return y + step * pm, p, x, pm


@jit
def close_loop(
    plants: FloatArray,
    table: FloatArray,
    reference: float,
    depth_step: float,
    pitch_limit: float,
    speed: float,
    step: float,
    push: FloatArray,
    out: FloatArray,
) -> None:
    """Fill out (n, t, 4) with angle, fin, depth and speed of n plants (n, 26) under the gains of table (k, 8).

    push (t,) is a disturbance moment in rad/s^2. With depth_step other than zero the reference is depth gain (z - depth_step),
    limited; else `reference` rad. What diverges is inf from there on.
    """
    now, scaled = np.empty(table.shape[1]), np.empty(6)
    for case in range(plants.shape[0]):
        row = plants[case]
        decay, late, most, slowing = row[10], int(row[11]), row[12], row[19]
        gains_at(table, speed, now)
        at_speed(row, 1.0, scaled)
        p = x = z = 0.0
        u = speed
        y, integral, start = at_rest(row, now)
        fin = start
        for i in range(out.shape[1]):
            out[case, i, 0], out[case, i, 1], out[case, i, 2], out[case, i, 3] = y, fin, z, u
            if not abs(p) < DIVERGED_RATE_RAD_S:
                out[case, i:, 0] = np.inf
                break
            if slowing > 0.0:
                gains_at(table, u, now)
                at_speed(row, u / speed, scaled)
            target = reference if depth_step == 0.0 else min(max(now[7] * (z - depth_step), -pitch_limit), pitch_limit)
            command, integral = commanded(now, target, y, p, integral, step)
            # the fin sees the command of `late` steps ago; its own column of out holds what was commanded meanwhile
            if late > 0:
                out[case, i, 1] = command
                command = out[case, i - late, 1] if i >= late else start
            goal = command + (fin - command) * decay
            new = fin + min(max(goal - fin, -most), most)
            held, before = 0.5 * (fin + new) + row[3], y
            y, p, x, middle = moved(row, scaled, held, push[i], step, (y, p, x))
            z -= u * 0.5 * (before + y) * step
            if slowing > 0.0:
                lost = u * u * (1.0 + row[20] * held * held) + row[21] * middle * middle
                u = max(u + step * slowing * (speed * speed - lost), SLOWEST_SHARE * speed)
            fin = new
