"""The compiled closed loop: a fin with angle and rate limit, lag and delay; the plant or the hull by the midpoint rule.

A plant is that of models/hull.py; a hull, in surge, sway and yaw, is that of turning/maneuvering/equations.py. The speed of a
plant falls in the turn, u' = a_u (u0^2 - u^2 (1 + f delta^2) - t r^2), its coefficients follow powers of u/u0, and
the gains are those of the schedule at that speed. Anti-windup: the integral is constant while the fin is at its limit and the
error has the sign that would increase it (conditional integration). A loop starts from its steady state under the reference zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldsid.dynamics.steady_kernel import MAX_RATE_RAD_S
from fieldsid.models.hull import Core, Kinds, core_at, kinds_of, named, power, slope, surge_slope
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit
from fieldsid.turning.maneuvering.equations import OFFSET, rudder_lift, servo
from fieldsid.turning.maneuvering.equations import midpoint_step as hull_step

GAINS = SPEED, KP, KI, KD, BIAS, REFERENCE_GAIN, FIN_LIMIT, DEPTH_GAIN = tuple(range(8))
"""Columns of the gains' rows."""
MOTION = ANGLE, FIN, DEPTH, SURGE = tuple(range(4))
"""Columns of the motion."""
SLOWEST_SHARE = 0.05
"""Least speed of a plant in its turn, over the initial one: the settling of a draw that comes to it depends on it."""


class Plants(NamedTuple):
    """Plants at the initial speed of a flight, (n,) each: damping, stiffness, authority, fin offset (rad).

    core (n, C) are the constants of models/hull.py; damping_power, authority_power and core_powers (n, C) the exponents of the
    speed; decay = exp(-step/lag), delay_steps and largest_move (rad a step) belong to the fin; drag, fin_loss and turn_loss to
    the loss of speed.
    """

    damping: FloatArray
    stiffness: FloatArray
    authority: FloatArray
    offset: FloatArray
    core: FloatArray
    damping_power: FloatArray
    authority_power: FloatArray
    core_powers: FloatArray
    decay: FloatArray
    delay_steps: FloatArray
    largest_move: FloatArray
    drag: FloatArray
    fin_loss: FloatArray
    turn_loss: FloatArray


class Dive(NamedTuple):
    """A step of depth (m), zero for none: the limit of the pitch reference (rad), lag (s) and level pitch (rad) of the path."""

    depth: float
    pitch_limit: float
    lag: float
    level: float


@inner
def gains_at(table: FloatArray, speed: float, out: FloatArray) -> None:
    """Fill out (8,) with the gains at a speed: linear between the rows of table (k, 8), constant beyond them."""
    last = table.shape[0] - 1
    below = 0
    while below < last - 1 and speed > table[below + 1, SPEED]:
        below += 1
    above = min(below + 1, last)
    width = table[above, SPEED] - table[below, SPEED]
    share = 0.0 if width <= 0.0 else min(max((speed - table[below, SPEED]) / width, 0.0), 1.0)
    for j in range(table.shape[1]):
        out[j] = table[below, j] + share * (table[above, j] - table[below, j])


@inner
def steady_state(stiffness: float, authority: float, offset: float, now: FloatArray) -> tuple[float, float, float]:
    """Return angle, integral and fin of the loop's steady state under the reference zero; angle and integral zero without one."""
    limit, bias, stiff = now[FIN_LIMIT], now[BIAS], stiffness + authority * now[KP]
    if not abs(offset) < limit or stiff == 0.0:
        return 0.0, 0.0, min(max(bias, -limit), limit)
    if now[KI] != 0.0:
        return 0.0, -(bias + offset) / now[KI], -offset
    angle = authority * (bias + offset) / stiff
    return angle, 0.0, min(max(bias - now[KP] * angle, -limit), limit)


@inner
def level_flight(
    stiffness: float, authority: float, offset: float, now: FloatArray, level: float
) -> tuple[float, float, float, float]:
    """Return angle, integral, fin and depth error of level flight, which takes the pitch `level`: the loop's gains hold it."""
    limit = now[FIN_LIMIT]
    fin = min(max(stiffness * level / authority - offset, -limit), limit)
    if now[KI] != 0.0:
        return level, (fin - now[BIAS] - now[REFERENCE_GAIN] * level) / now[KI], fin, level / now[DEPTH_GAIN]
    target = (fin - now[BIAS] + now[KP] * level) / (now[KP] + now[REFERENCE_GAIN])
    return level, 0.0, fin, target / now[DEPTH_GAIN]


@inner
def start_of(stiffness: float, authority: float, offset: float, now: FloatArray, dive: Dive) -> tuple[float, float, float, float]:
    """Return angle, integral, fin and depth error at the start of a flight: of level flight in a dive, else the steady state."""
    if dive.depth != 0.0 and now[DEPTH_GAIN] != 0.0:
        return level_flight(stiffness, authority, offset, now, dive.level)
    angle, integral, fin = steady_state(stiffness, authority, offset, now)
    return angle, integral, fin, 0.0


@inner
def target_of(reference: float, dive: Dive, now: FloatArray, z: float) -> float:
    """Return the angle that is to be reached: the reference, in a dive that of the depth error, limited."""
    if dive.depth == 0.0:
        return reference
    return float(min(max(now[DEPTH_GAIN] * (z - dive.depth), -dive.pitch_limit), dive.pitch_limit))


@inner
def fin_command(now: FloatArray, target: float, y: float, p: float, integral: float, step: float) -> tuple[float, float]:
    """Return the fin command and the integral, which does not change where the fin is at its limit and the error increases it."""
    error = target - y
    wanted = now[KP] * error + now[KI] * integral - now[KD] * p + now[BIAS] + now[REFERENCE_GAIN] * target
    command = min(max(wanted, -now[FIN_LIMIT]), now[FIN_LIMIT])
    if command == wanted or (wanted - command) * now[KP] * error <= 0.0:
        integral += error * step
    return command, integral


@inner
def midpoint_step(
    k: Core, kinds: Kinds, a: float, stiffness: float, moment: float, fin: float, step: float, state: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Return angle, rate and cross state after a step by the midpoint rule, and the rate at its midpoint."""
    y, p, x = state
    h = 0.5 * step
    now = slope(k, kinds, a, stiffness, moment, fin, 1.0, y, p, x, 0.0)
    middle = p + h * now.rate
    then = slope(k, kinds, a, stiffness, moment, fin, 1.0, y + h * p, middle, x + h * now.cross, 0.0)
    return y + step * middle, p + step * then.rate, x + step * then.cross, middle


@inner
def delayed(out: FloatArray, case: int, i: int, late: float, start: float) -> float:
    """Return the command of `late` steps before step i, from the fin's column of out (n, t, 4); `start` before the first."""
    full = int(late)
    newer = out[case, i - full, FIN] if i >= full else start
    older = out[case, i - full - 1, FIN] if i > full else start
    return float(newer + (late - full) * (older - newer))


@inner
def hull_of(hulls: FloatArray, case: int, offset: float, speed: float, out: FloatArray) -> float:
    """Fill out (22,) with the coefficients of a hull, if there is one, with the fin's offset (rad); return its fin's lift."""
    if hulls.shape[0] > 0:
        for j in range(out.shape[0]):
            out[j] = hulls[case, j]
        out[OFFSET] = offset
    return rudder_lift(out, speed)


@jit
def close_loop(
    plants: Plants, hulls: FloatArray, table: FloatArray, reference: float, dive: Dive, speed: float, step: float,
    push: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Fill out (n, t, 4) with angle, fin, depth and speed of n plants under the gains of table (k, 8).

    hulls (n, 22), or (0, 22): vehicles in surge, sway and yaw, of which the plants are the linearisation and have the fin. push
    (t,) is a disturbance moment in rad/s^2. In a dive the reference is depth gain (z - its depth), limited, and the flight begins
    at the depth that the loop holds for the depth zero; else it is `reference` rad. Where a plant diverges its angle is inf.
    """
    now, of_hull, hull = np.empty(table.shape[1]), hulls.shape[0] > 0, np.ones(hulls.shape[1])
    for case in range(out.shape[0]):
        stiffness, offset, drag = plants.stiffness[case], plants.offset[case], plants.drag[case]
        late, most, keep = plants.delay_steps[case], plants.largest_move[case], plants.decay[case]
        kinds, a, b = kinds_of(plants.core[case]), plants.damping[case], plants.authority[case]
        sign, sway = 1.0 if b < 0.0 else -1.0, 0.0  # a positive fin of a hull's equations turns to port
        lift = hull_of(hulls, case, sign * offset, speed, hull)
        gains_at(table, speed, now)
        core = plants.core[case].copy()  # for `core[:] =` numba would compile the text of its shape error, for 2 s
        y, integral, start, z = start_of(stiffness, b, offset, now, dive)
        u, p, x, fin, path = speed, 0.0, 0.0, start, 0.0
        follows = 1.0 - np.exp(-step / dive.lag) if dive.lag > 0.0 else 1.0
        for i in range(out.shape[1]):
            out[case, i, ANGLE], out[case, i, FIN], out[case, i, DEPTH], out[case, i, SURGE] = y, fin, z, u
            if not abs(p) < MAX_RATE_RAD_S:
                out[case, i:, ANGLE] = np.inf
                break
            if u != speed:
                gains_at(table, u, now)
            target = target_of(reference, dive, now, z)
            command, integral = fin_command(now, target, y, p, integral, step)
            # the fin receives the command of `late` steps ago; the fin's column of out stores the commands until then
            if late > 0.0 or of_hull:
                out[case, i, FIN] = command
                command = delayed(out, case, i, late, start)
            new = servo(fin, command, 1.0 - keep, most)
            if of_hull:
                fins = sign * fin, sign * servo(fin, command, 1.0 - np.sqrt(keep), 0.5 * most)
                u, sway, p, middle = hull_step(u, sway, p, fins, 1.0, speed, lift, hull, step, push[i])
                y += step * middle
            else:
                if drag > 0.0:
                    core_at(plants.core[case], plants.core_powers[case], u / speed, core)
                    a = plants.damping[case] * power(u / speed, plants.damping_power[case])
                    b = plants.authority[case] * power(u / speed, plants.authority_power[case])
                mean, before, was = 0.5 * (fin + new) + offset, y, path
                y, p, x, middle = midpoint_step(named(core), kinds, a, stiffness, b * mean + push[i], mean, step, (y, p, x))
                path += follows * (0.5 * (before + y) - dive.level - path)
                z -= u * 0.5 * (was + path) * step
                to_surge = surge_slope(u, speed, drag, plants.fin_loss[case], plants.turn_loss[case], mean, middle)
                u = max(u + step * to_surge, SLOWEST_SHARE * speed)
            fin = new
