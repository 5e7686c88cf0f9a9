"""The equations of motion in fine steps (fourth-order Runge-Kutta) with the pilot in the loop, compiled."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from truth.fin_path import delayed, fin_step

ANGLE, RATE, CROSS, ROLL, ROLL_RATE, DEPTH, SURGE, MEMORY, SLOSH, SLOSH_RATE = range(10)
STATES = 10
DISTURBANCE, EVENT, AUTHORITY, DAMPING, JAM, THRUST, ROLL_PUSH, ANGLE_NOISE, RATE_NOISE = range(9)
INPUTS = 9
"""Rows of `inputs` (9, n): two moments (rad/s^2), factors on authority and damping, whether the fin is jammed, thrust (N), roll
acceleration (rad/s^2), noise of angle and rate."""
OPEN, HOLD, ZIGZAG = 0, 1, 2


@nb.njit(cache=True)
def crossflow(s, p):
    """Return 32 times the integral over xi in [-1/2, 1/2] of (s + xi p)|s + xi p| xi, exactly."""
    if abs(s) >= 0.5 * abs(p):
        return 32.0 * math.copysign(1.0, s) * s * p / 6.0
    k = -s / p
    at = s * s * k * k / 2.0 + 2.0 * s * p * k**3 / 3.0 + p * p * k**4 / 4.0
    high = s * s / 8.0 + 2.0 * s * p / 24.0 + p * p / 64.0
    low = s * s / 8.0 - 2.0 * s * p / 24.0 + p * p / 64.0
    return 32.0 * math.copysign(1.0, p) * (high + low - 2.0 * at)


@nb.njit(cache=True)
def strips(s, p):
    """Return the integral over xi in [-1/2, 1/2] of (s + xi p)|s + xi p|.

    By Simpson's rule on either side of the station where the flow changes sign.
    """
    turn = min(max(-s / p, -0.5), 0.5) if p != 0.0 else 0.5
    total = 0.0
    for low, high in ((-0.5, turn), (turn, 0.5)):
        for xi, w in ((low, 1.0), (0.5 * (low + high), 4.0), (high, 1.0)):
            flow = s + xi * p
            total += w / 6.0 * (high - low) * flow * abs(flow)
    return total


@nb.njit(cache=True)
def moments(y, q, t, event, thrust):
    """Return the sum of the moments other than damping, stiffness and fin, in rad/s^2."""
    deep = y[DEPTH] - q.depth_reference
    m = event + q.thrust_moment * thrust + q.roll_moment * y[ROLL] + q.depth_moment * deep
    m += q.thrust_square * (thrust - q.reference_thrust) ** 2 + q.roll_rate_moment * y[ROLL_RATE] + q.depth_square * deep**2
    m += q.speed_moment * (y[SURGE] ** 2 - q.speed_reference**2) - q.cross_moment * y[CROSS]
    if q.drift != 0.0:
        m += q.drift * t if q.drift_tau <= 0.0 else q.drift * q.drift_tau * (1.0 - math.exp(-max(t, 0.0) / q.drift_tau))
    if q.wave_amplitude != 0.0:
        a = 2.0 * math.pi * t / q.wave_period + q.wave_phase
        m += q.wave_amplitude * (math.sin(a) + q.wave_second * math.sin(1.31 * a))
    if q.current_sin != 0.0 or q.current_cos != 0.0:
        seen = y[ANGLE] - q.current_turn * (t - 30.0)
        m += q.current_sin * math.sin(seen) + q.current_cos * math.cos(seen) + q.current_twice * math.sin(2.0 * seen)
    if q.quadratic != 0.0:
        m -= q.quadratic * math.copysign(abs(y[RATE]) ** q.quadratic_exponent, y[RATE])
    if q.crossflow != 0.0:
        m -= q.crossflow * crossflow(y[CROSS] / q.length, y[RATE])
    if q.memory_moment != 0.0:
        m += q.memory_moment * y[MEMORY]
    if q.slosh_moment != 0.0:
        m += q.slosh_moment * (q.slosh_omega**2 * y[SLOSH] + 2.0 * q.slosh_zeta * q.slosh_omega * y[SLOSH_RATE])
    return m


@nb.njit(cache=True)
def slope(y, out, q, t, fin, now, pitching):
    """Write the time derivative of the state (10,) to `out`; `now` (9,): the inputs at time t."""
    authority, damping = q.authority * now[AUTHORITY], q.damping * now[DAMPING]
    if q.speed_varying > 0.0:
        ratio = y[SURGE] / q.median_speed
        authority *= ratio * ratio
        damping *= ratio**q.damping_power
    m = moments(y, q, t, now[EVENT], now[THRUST]) + now[DISTURBANCE]
    if t >= q.step_time:
        share = 1.0 if q.step_ramp <= 0.0 else min((t - q.step_time) / q.step_ramp, 1.0)
        authority *= 1.0 - share * q.step_loss
        m += share * q.step_moment
    restoring = q.stiffness * y[ANGLE] - q.trim
    if q.righting > 0.0:
        restoring = q.stiffness * math.sin(y[ANGLE]) - q.trim * math.cos(y[ANGLE])
    out[ANGLE] = y[RATE]
    out[RATE] = -damping * y[RATE] - restoring + authority * (fin + q.fin_bend) + m
    out[CROSS] = (
        -q.cross_damping * y[CROSS] - q.cross_rate * y[RATE] + q.cross_fin * fin - q.cross_quadratic * y[CROSS] * abs(y[CROSS])
    )
    if q.cross_strips != 0.0:
        out[CROSS] -= q.cross_strips * q.length**2 * strips(y[CROSS] / q.length, y[RATE])
    out[ROLL] = y[ROLL_RATE]
    turn = 0.0 if pitching else q.roll_by_turn * y[RATE] * y[SURGE]
    out[ROLL_RATE] = -2.0 * q.roll_zeta * q.roll_omega * y[ROLL_RATE] - q.roll_omega**2 * y[ROLL] + turn + now[ROLL_PUSH]
    out[DEPTH] = -y[SURGE] * math.sin(y[ANGLE]) if pitching else 0.0
    wanted = q.nominal_speed * math.sqrt(max(now[THRUST], 0.0) / q.nominal_thrust)
    out[SURGE] = (wanted - y[SURGE]) / q.surge_tau - q.surge_loss * y[RATE] ** 2
    out[MEMORY] = (fin * fin - y[MEMORY]) / q.memory_tau
    out[SLOSH] = y[SLOSH_RATE]
    out[SLOSH_RATE] = -(q.slosh_omega**2) * y[SLOSH] - 2.0 * q.slosh_zeta * q.slosh_omega * y[SLOSH_RATE] - out[RATE]


@nb.njit(cache=True)
def advance(y, work, q, t, h, fin, now, pitching):
    """Advance the state y (10,) by one Runge-Kutta step of length h (s); `work` (5, 10) is scratch."""
    slope(y, work[0], q, t, fin, now, pitching)
    for i in range(STATES):
        work[4, i] = y[i] + 0.5 * h * work[0, i]
    slope(work[4], work[1], q, t + 0.5 * h, fin, now, pitching)
    for i in range(STATES):
        work[4, i] = y[i] + 0.5 * h * work[1, i]
    slope(work[4], work[2], q, t + 0.5 * h, fin, now, pitching)
    for i in range(STATES):
        work[4, i] = y[i] + h * work[2, i]
    slope(work[4], work[3], q, t + h, fin, now, pitching)
    for i in range(STATES):
        y[i] += h / 6.0 * (work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i])


@nb.njit(cache=True)
def pilot(mode, held, angle, rate, q, last):
    """Return the fin command of the closed-loop modes, within the fin's limit; `held`: the angle to keep."""
    sign = math.copysign(1.0, q.authority)
    if mode == ZIGZAG:
        away = (angle - held) * sign
        if last == 0.0 or abs(abs(last) - q.zigzag_fin) > 1e-12:
            return q.zigzag_fin
        if last > 0.0 and away > q.zigzag_angle:
            return -q.zigzag_fin
        if last < 0.0 and away < -q.zigzag_angle:
            return q.zigzag_fin
        return last
    asked = sign * (-q.kp * (angle - held) - q.kd * rate)
    return min(max(asked + q.fin_trim, -q.fin_limit), q.fin_limit)


@nb.njit(cache=True)
def fly(q, y, plan, mode, inputs, known, sample, steps, origin, pitching):
    """Fly one run; return command (n,), angle, rate and fin at the fine steps (n * steps, 3), states (n, 10) at the samples.

    plan, mode (n,): the open-loop command, and whether it, the pilot or the zig-zag rule steers; in HOLD a plan other than zero
    makes the pilot keep the angle at which HOLD begins, not the initial one. inputs (9, n). known (3, n): roll, depth and surge
    to impose, or (3, 0) to simulate them. origin: time of sample 0, in s.
    """
    n = plan.size
    command, fine, states = np.zeros(n), np.zeros((n * steps, 3)), np.zeros((n, STATES))
    memory, work, now = np.zeros(5), np.zeros((5, STATES)), np.zeros(INPUTS)
    h, held, last_mode, replay = sample / steps, y[ANGLE], -1, known.shape[1] > 0
    for k in range(n):
        after = min(k + 1, n - 1)
        angle, rate = y[ANGLE] + inputs[ANGLE_NOISE, k], y[RATE] + inputs[RATE_NOISE, k]
        if mode[k] == HOLD and last_mode != HOLD and last_mode >= 0 and q.stiffness == 0.0 and plan[k] != 0.0:
            held = angle  # keep the present course, not the initial one
        last_mode = mode[k]
        last = command[k - 1] if k > 0 else 0.0
        steered = pilot(mode[k], held, angle, rate, q, last)
        command[k] = min(max(plan[k] + q.fin_trim, -q.fin_limit), q.fin_limit) if mode[k] == OPEN else steered
        if k == 0:
            memory[0], memory[1], memory[3] = command[0], command[0], command[0]
        states[k] = y
        for j in range(steps):
            share = (j + 0.5) / steps
            for i in range(INPUTS):
                now[i] = inputs[i, k] + share * (inputs[i, after] - inputs[i, k])
            now[AUTHORITY], now[DAMPING], now[JAM] = inputs[AUTHORITY, k], inputs[DAMPING, k], inputs[JAM, k]
            if replay:
                y[ROLL] = known[0, k] + share * (known[0, after] - known[0, k])
                y[DEPTH] = known[1, k] + share * (known[1, after] - known[1, k])
                y[SURGE] = known[2, k] + share * (known[2, after] - known[2, k])
            t = k * sample + j * h
            fine[k * steps + j, 0], fine[k * steps + j, 1] = y[ANGLE], y[RATE]
            fin = fine[k * steps + j - 1, 2] if now[JAM] > 0.0 and k > 0 else 0.0
            if now[JAM] <= 0.0 or k == 0:
                fin = fin_step(memory, delayed(command, k, t, h, sample, q.delay), h, q)
            fine[k * steps + j, 2] = fin
            advance(y, work, q, t + origin, h, fin, now, pitching)
    return command, fine, states
