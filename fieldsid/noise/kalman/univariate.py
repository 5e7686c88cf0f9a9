"""The compiled Kalman filter of the motion that noise causes, which takes the two samples of an instant one after the other.

State (y, p, w, n_y, n_p) of noise/whiten.py: an angle is measured as y + n_y, a rate as p + n_p, each with white noise. Once the
gains are unchanged over a few consecutive steps of equal length, they are taken as constant until a sample is missing or the step
changes. Source: Koopman and Durbin 2000, Fast filtering and smoothing for multivariate state space models, J. Time Series
Analysis 21(3).
"""

from __future__ import annotations

import numpy as np

from fieldsid.noise.kalman.transition import is_other_step, transition
from fieldsid.numerics.arrays import BoolArray, FloatArray
from fieldsid.numerics.jit import inner, jit

STATES = 5
Vector = tuple[float, float, float, float, float]
Moves = tuple[float, float, float, float, float, float, float, float]
"""A step: y and p from (y, p, w) each, and the decays of w and of the sensor noise."""
Upper = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float, float
]  # fmt: skip
"""The upper triangle of a covariance (5, 5), row by row: as numbers, not an array, so that they stay in registers."""
STEADY_GAIN_STEPS = 4
"""Number of consecutive steps with unchanged gains after which the gains are taken as constant."""


@jit
def kalman_filter(
    steps: FloatArray, ok: BoolArray, a: float, k: float, noise: FloatArray,
    series: FloatArray, out: FloatArray, spread: FloatArray,
) -> float:  # fmt: skip
    """Fill out (m, 2, n) with the standardised innovations of series (m, 2, n), spread (2, n) with their standard deviations.

    noise is a vector (7,) in the order of NOISE_FIELDS, which acts on a base of damping a and stiffness k. Samples not measured
    (`ok` (2, n) false) give zero and one. Returns the sum of the log variances.
    """
    n, count, coloured = steps.shape[0] + 1, series.shape[0], noise[4] + noise[5] > 0.0
    w, m, q = noise[2] ** 2, noise[4] ** 2, noise[5] ** 2
    covariance = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, w, 0.0, 0.0, m, 0.0, q)
    moves, states = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0), np.zeros((count, STATES))
    of_angle, of_rate = (0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0)
    h, settled, i, logs = -1.0, 0, 0, 0.0
    while i < n:
        if settled >= STEADY_GAIN_STEPS:
            stop, settled = _steady_until(steps, ok, i, h), 0
            response, gain = _steady_response(of_angle, of_rate, moves), of_angle[1] + of_angle[4]
            for j in range(count):
                if coloured:
                    _filter_steady_with_sensors(series, out, j, i, stop, states, response, gain, spread)
                else:
                    _filter_steady(series, out, j, i, stop, states, response, gain, spread)
            logs += 2.0 * (stop - i) * np.log(spread[0, i - 1] * spread[1, i - 1])
            for l in range(i, stop):
                spread[0, l], spread[1, l] = spread[0, i - 1], spread[1, i - 1]
            i = stop
            continue
        is_steady, last_of_angle, last_of_rate = ok[0, i] and ok[1, i], of_angle, of_rate
        if i < n - 1 and is_other_step(steps[i], h):
            is_steady, h = False, steps[i]
            yy, yp, py, pp, yw, pw = transition(a, k, h)
            moves = (yy, yp, yw, py, pp, pw, np.exp(-h / noise[3]), np.exp(-h / noise[6]))
        c = covariance
        r = (c[0] + c[3], c[1] + c[7], c[2] + c[10], c[3] + c[12], c[4] + c[13])  # those of y + n_y with the state
        share = 1.0 / (r[0] + r[3] + noise[0] ** 2) if ok[0, i] else 0.0
        of_angle, root_y, covariance = _gains(r, share), np.sqrt(share), _measured(covariance, r, share)
        c = covariance
        r = (c[1] + c[4], c[5] + c[8], c[6] + c[11], c[7] + c[13], c[8] + c[14])  # those of p + n_p
        share = 1.0 / (r[1] + r[4] + noise[1] ** 2) if ok[1, i] else 0.0
        of_rate, root_p, covariance = _gains(r, share), np.sqrt(share), _measured(covariance, r, share)
        covariance = _predicted(covariance, moves, w, m, q)
        is_steady = is_steady and _repeat(of_angle, last_of_angle) and _repeat(of_rate, last_of_rate)
        settled = settled + 1 if is_steady else 0
        for j in range(count):
            e_y, e_p = _advance(states, j, of_angle, of_rate, moves, series[j, 0, i], series[j, 1, i])
            out[j, 0, i], out[j, 1, i] = e_y * root_y, e_p * root_p
        spread[0, i] = 1.0 / root_y if ok[0, i] else 1.0
        spread[1, i] = 1.0 / root_p if ok[1, i] else 1.0
        logs += 2.0 * np.log(spread[0, i] * spread[1, i])
        i += 1
    return logs


@inner
def _gains(r: Vector, share: float) -> Vector:
    """Return the Kalman gains for a sample: `r` are its covariances with the state, `share` is one over its variance."""
    return r[0] * share, r[1] * share, r[2] * share, r[3] * share, r[4] * share


@inner
def _measured(covariance: Upper, r: Vector, share: float) -> Upper:
    """Return the covariance after a sample, as in `_gains`; share is zero where it was not measured."""
    c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44 = covariance
    g0, g1, g2, g3, g4 = _gains(r, share)
    return (
        c00 - g0 * r[0], c01 - g0 * r[1], c02 - g0 * r[2], c03 - g0 * r[3], c04 - g0 * r[4], c11 - g1 * r[1], c12 - g1 * r[2],
        c13 - g1 * r[3], c14 - g1 * r[4], c22 - g2 * r[2], c23 - g2 * r[3], c24 - g2 * r[4], c33 - g3 * r[3], c34 - g3 * r[4],
        c44 - g4 * r[4],
    )  # fmt: skip


@inner
def _predicted(covariance: Upper, moves: Moves, w: float, m: float, q: float) -> Upper:
    """Return the covariance of the next state; w, m and q are the stationary variances of (w, n_y, n_p)."""
    c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44 = covariance
    yy, yp, yw, py, pp, pw, ww, mm = moves
    u0, u1, u2 = yy * c00 + yp * c01 + yw * c02, yy * c01 + yp * c11 + yw * c12, yy * c02 + yp * c12 + yw * c22
    v0, v1, v2 = py * c00 + pp * c01 + pw * c02, py * c01 + pp * c11 + pw * c12, py * c02 + pp * c12 + pw * c22
    return (
        u0 * yy + u1 * yp + u2 * yw, u0 * py + u1 * pp + u2 * pw, u2 * ww,
        (yy * c03 + yp * c13 + yw * c23) * mm, (yy * c04 + yp * c14 + yw * c24) * mm, v0 * py + v1 * pp + v2 * pw, v2 * ww,
        (py * c03 + pp * c13 + pw * c23) * mm, (py * c04 + pp * c14 + pw * c24) * mm, w + (c22 - w) * ww * ww,
        c23 * ww * mm, c24 * ww * mm, m + (c33 - m) * mm * mm, c34 * mm * mm, q + (c44 - q) * mm * mm,
    )  # fmt: skip


@inner
def _advance(
    states: FloatArray, j: int, of_angle: Vector, of_rate: Vector, moves: Moves, angle: float, rate: float
) -> tuple[float, float]:
    """Update state j by both samples and move it by one step; return the innovations of the samples."""
    y, p, w, n_y, n_p = states[j, 0], states[j, 1], states[j, 2], states[j, 3], states[j, 4]
    e_y = angle - y - n_y
    y, p, w = y + of_angle[0] * e_y, p + of_angle[1] * e_y, w + of_angle[2] * e_y
    n_y, n_p = n_y + of_angle[3] * e_y, n_p + of_angle[4] * e_y
    e_p = rate - p - n_p
    y, p, w = y + of_rate[0] * e_p, p + of_rate[1] * e_p, w + of_rate[2] * e_p
    n_y, n_p = n_y + of_rate[3] * e_p, n_p + of_rate[4] * e_p
    states[j, 0], states[j, 1] = moves[0] * y + moves[1] * p + moves[2] * w, moves[3] * y + moves[4] * p + moves[5] * w
    states[j, 2], states[j, 3], states[j, 4] = moves[6] * w, moves[7] * n_y, moves[7] * n_p
    return e_y, e_p


@inner
def _repeat(gains: Vector, last: Vector) -> bool:
    """Whether the gains equal those of the previous sample."""
    same = True
    for s in range(STATES):
        same = same and abs(gains[s] - last[s]) < 1e-7 * (abs(gains[s]) + 1e-6)
    return same


@inner
def _steady_until(steps: FloatArray, ok: BoolArray, first: int, h: float) -> int:
    """Return the first sample from `first` on at which a channel is missing or which is not followed by a step of h."""
    n, i = steps.shape[0] + 1, first
    while i < n and ok[0, i] and ok[1, i] and (i == n - 1 or not is_other_step(steps[i], h)):
        i += 1
    return i


@inner
def _steady_response(of_angle: Vector, of_rate: Vector, moves: Moves) -> FloatArray:
    """Return the next state (7, 5) after each state of size one, and after a sample of size one of the angle and of the rate."""
    response = np.zeros((STATES + 2, STATES))
    for c in range(STATES + 2):
        if c < STATES:
            response[c, c] = 1.0
        _advance(response, c, of_angle, of_rate, moves, 1.0 * (c == STATES), 1.0 * (c == STATES + 1))
    return response


@inner
def _filter_steady(
    series: FloatArray, out: FloatArray, j: int, first: int, stop: int,
    states: FloatArray, m: FloatArray, gain: float, spread: FloatArray,
) -> None:  # fmt: skip
    """Filter series j over samples first..stop - 1 with the gains of the sample before: one short chain of sums for each sample.

    m (7, 5) is the steady response, of which that of (y, p, w) is used; `gain` is the share of the angle's innovation that is
    subtracted from the rate's.
    """
    yy, yp, yw, ya, yr = m[0, 0], m[1, 0], m[2, 0], m[5, 0], m[6, 0]
    py, pp, pw, pa, pr = m[0, 1], m[1, 1], m[2, 1], m[5, 1], m[6, 1]
    wy, wp, ww, wa, wr = m[0, 2], m[1, 2], m[2, 2], m[5, 2], m[6, 2]
    y, p, w, of_angle, of_rate = states[j, 0], states[j, 1], states[j, 2], 1.0 / spread[0, first - 1], 1.0 / spread[1, first - 1]
    for i in range(first, stop):
        angle, rate = series[j, 0, i], series[j, 1, i]
        e = angle - y
        out[j, 0, i], out[j, 1, i] = e * of_angle, (rate - p - gain * e) * of_rate
        y, p, w = (
            (yy * y + yp * p) + (yw * w + (ya * angle + yr * rate)),
            (py * y + pp * p) + (pw * w + (pa * angle + pr * rate)),
            (wy * y + wp * p) + (ww * w + (wa * angle + wr * rate)),
        )
    states[j, 0], states[j, 1], states[j, 2] = y, p, w


@inner
def _filter_steady_with_sensors(
    series: FloatArray, out: FloatArray, j: int, first: int, stop: int,
    states: FloatArray, m: FloatArray, gain: float, spread: FloatArray,
) -> None:  # fmt: skip
    """Filter series j with constant gains as `_filter_steady` does, with all five states."""
    y, p, w, n_y, n_p = states[j, 0], states[j, 1], states[j, 2], states[j, 3], states[j, 4]
    of_angle, of_rate = 1.0 / spread[0, first - 1], 1.0 / spread[1, first - 1]
    for i in range(first, stop):
        angle, rate = series[j, 0, i], series[j, 1, i]
        e = angle - y - n_y
        out[j, 0, i], out[j, 1, i] = e * of_angle, (rate - p - n_p - gain * e) * of_rate
        y, p, w, n_y, n_p = (
            (m[0, 0] * y + m[1, 0] * p) + (m[2, 0] * w + (m[3, 0] * n_y + m[4, 0] * n_p)) + (m[5, 0] * angle + m[6, 0] * rate),
            (m[0, 1] * y + m[1, 1] * p) + (m[2, 1] * w + (m[3, 1] * n_y + m[4, 1] * n_p)) + (m[5, 1] * angle + m[6, 1] * rate),
            (m[0, 2] * y + m[1, 2] * p) + (m[2, 2] * w + (m[3, 2] * n_y + m[4, 2] * n_p)) + (m[5, 2] * angle + m[6, 2] * rate),
            (m[0, 3] * y + m[1, 3] * p) + (m[2, 3] * w + (m[3, 3] * n_y + m[4, 3] * n_p)) + (m[5, 3] * angle + m[6, 3] * rate),
            (m[0, 4] * y + m[1, 4] * p) + (m[2, 4] * w + (m[3, 4] * n_y + m[4, 4] * n_p)) + (m[5, 4] * angle + m[6, 4] * rate),
        )
    states[j, 0], states[j, 1], states[j, 2], states[j, 3], states[j, 4] = y, p, w, n_y, n_p
