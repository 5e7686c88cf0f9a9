"""From the commanded fin angle to the effective one, by fine steps: delay, rate limit, lag, play, dead zone, lift curve."""

from __future__ import annotations

import math

import numba as nb


@nb.njit(cache=True)
def delayed(command, newest, start, step, sample, delay):
    """Return the mean of the zero-order-hold command over [start, start + step] - delay; before sample 0 that of sample 0."""
    a = (start - delay) / sample
    b = (start + step - delay) / sample
    ia = min(max(math.floor(a + 1e-9), 0), newest)
    ib = min(max(math.floor(b - 1e-9), 0), newest)
    if ia == ib:
        return command[ia]
    share = min(max((ib - a) / (b - a), 0.0), 1.0)
    return command[ia] * share + command[ib] * (1.0 - share)


@nb.njit(cache=True)
def lagged(memory, target, step, physics):
    """Return the mean over the step of the angle of a first- or second-order servo; `memory` is advanced."""
    before = memory[1]
    if physics.servo_omega > 0.0:
        w, z = physics.servo_omega, physics.servo_zeta
        small = step / 4
        for _ in range(4):
            memory[2] += small * (w * w * (target - memory[1]) - 2.0 * z * w * memory[2])
            memory[1] += small * memory[2]
    elif physics.servo_tau > 0.0:
        tau = physics.servo_tau * (physics.falling_tau if target < before else 1.0)
        memory[1] = target + (before - target) * math.exp(-step / tau)
        return target + (before - target) * tau / step * (1.0 - math.exp(-step / tau))
    else:
        memory[1] = target
        return target
    return 0.5 * (before + memory[1])


@nb.njit(cache=True)
def dead_zone(memory, d, physics):
    """Return the angle after a dead zone of width w: zero below it and |d| - w above.

    A sticking one passes the whole angle once it exceeds w, until it is below w / 2.
    """
    w = physics.deadband_width
    if w <= 0.0:
        return d
    d -= physics.deadband_middle
    if physics.deadband_sticks > 0.0:
        if abs(d) > w:
            memory[4] = 1.0
        elif abs(d) < 0.5 * w:
            memory[4] = 0.0
        return d if memory[4] > 0.0 else 0.0
    return 0.0 if abs(d) < w else d - math.copysign(w, d)


@nb.njit(cache=True)
def lift(d, physics):
    """Return the effective angle after the fin's asymmetry and its loss of lift beyond the stall angle.

    The loss begins sharply, or blended over `stall_blend` rad.
    """
    d = d * (1.0 + physics.asymmetry if d > 0.0 else 1.0 - physics.asymmetry) + physics.lift_bend * d * d
    if physics.stall_angle <= 0.0:
        return d
    over = abs(d) - physics.stall_angle
    if physics.stall_blend > 0.0:
        width = physics.stall_blend
        soft = width * (math.log1p(math.exp(-abs(over) / width)) + max(over, 0.0) / width)
        rest = width * math.log1p(math.exp(-physics.stall_angle / width))
        return math.copysign(1.0, d) * (abs(d) - (1.0 - physics.stall_slope) * (soft - rest))
    if over <= 0.0:
        return d
    return math.copysign(1.0, d) * (physics.stall_angle * (1.0 - physics.stall_drop) + physics.stall_slope * over)


@nb.njit(cache=True)
def fin_step(memory, target, step, physics):
    """Return the effective fin angle over one step for a delayed command.

    `memory` (5,) is advanced: the angle after the rate limit, that after the lag, its rate, the angle after the play, and
    whether a sticking dead zone passes it.
    """
    if physics.max_rate > 0.0:
        reach = physics.max_rate * step * (physics.falling_rate if target < memory[0] else 1.0)
        moved = min(max(target - memory[0], -reach), reach)
        target = memory[0] + 0.5 * moved if abs(moved) >= reach else target
        memory[0] += moved
    else:
        memory[0] = target
    d = lagged(memory, target, step, physics)
    if physics.backlash_gap > 0.0:
        half = 0.5 * physics.backlash_gap
        memory[3] = min(max(memory[3], d - half), d + half)
        d = memory[3]
    return lift(dead_zone(memory, d, physics), physics)
