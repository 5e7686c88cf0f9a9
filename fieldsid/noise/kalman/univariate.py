"""The compiled Kalman filter of the motion that noise causes, which takes the two samples of an instant one after the other.

State (y, p, w, n_y, n_p) of noise/whiten.py, its covariance the 15 numbers of a symmetric matrix. One source is compiled three
times: with all five states; with them for eight noises abreast, which the processor vectorises; and with (y, p, w) alone, where
only the water or only the sensors wander. What the sensors do then takes the places of y and p.
Source: Koopman and Durbin 2000, Fast filtering and smoothing for multivariate state space models, J. Time Series Analysis 21(3).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldsid.noise.kalman.transition import is_other_step, transition
from fieldsid.numerics.arrays import BoolArray, FloatArray
from fieldsid.numerics.jit import inner, jit

Filter = Callable[[FloatArray, BoolArray, float, float, FloatArray, FloatArray, FloatArray, FloatArray], float]

STEADY_GAIN_STEPS = 4
"""Steps in a row that leave the gains as they are, after which they are kept."""
LANES = 8
"""Noises that are filtered abreast."""
GAINS, ROOTS, WHITE, WANDER, ADDED, KEPT, STATE, ROWS = 15, 25, 27, 29, 34, 39, 41, 48
"""Where, after the covariance, what belongs to a noise begins, in rows of one number for each."""


@inner
def _learnt(
    r0: float, r1: float, r2: float, share: float, c00: float, c01: float, c02: float, c11: float, c12: float, c22: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return the gains of (y, p, w) by a sample, and what it leaves of their covariance.

    r are the sample's covariances with them, share is one over its variance, or nil where it was not measured.
    """
    g0, g1, g2 = r0 * share, r1 * share, r2 * share
    return g0, g1, g2, c00 - g0 * r0, c01 - g0 * r1, c02 - g0 * r2, c11 - g1 * r1, c12 - g1 * r2, c22 - g2 * r2


@inner
def _learnt_of_sensors(
    r0: float, r1: float, r2: float, r3: float, r4: float, share: float,
    c03: float, c04: float, c13: float, c14: float, c23: float, c24: float, c33: float, c34: float, c44: float,
) -> tuple[float, float, float, float, float, float, float, float, float, float, float]:  # fmt: skip
    """Return the gains of (n_y, n_p) by a sample, and what it leaves of their covariances with the state."""
    g3, g4, s3, s4 = r3 * share, r4 * share, r3 * share, r4 * share
    return (
        g3, g4, c03 - r0 * s3, c04 - r0 * s4, c13 - r1 * s3, c14 - r1 * s4, c23 - r2 * s3, c24 - r2 * s4,
        c33 - g3 * r3, c34 - g3 * r4, c44 - g4 * r4,
    )  # fmt: skip


@inner
def _corrected(
    e: float, room: FloatArray, at: int, lanes: int, coloured: bool, y: float, p: float, w: float, m: float, q: float
) -> tuple[float, float, float, float, float]:
    """Return the state after a sample that was e above what was expected; its gains begin at a place of the room."""
    y, p, w = y + room[at] * e, p + room[at + lanes] * e, w + room[at + 2 * lanes] * e
    return (y, p, w, m + room[at + 3 * lanes] * e, q + room[at + 4 * lanes] * e) if coloured else (y, p, w, m, q)


@inner
def _repeats(gain: float, last: float) -> bool:
    """Whether a gain is what it was at the sample before."""
    return abs(gain - last) < 1e-7 * (abs(gain) + 1e-6)


@inner
def _steady_until(steps: FloatArray, ok: BoolArray, first: int, h: float) -> int:
    """Return the first sample from `first` on that is not measured in full or not followed by a step of h."""
    n, i = steps.shape[0] + 1, first
    while i < n and ok[0, i] and ok[1, i] and (i == n - 1 or not is_other_step(steps[i], h)):
        i += 1
    return i


@inner
def _settled(
    series: FloatArray, out: FloatArray, first: int, stop: int, state: FloatArray, m: FloatArray, gain: float, roots: FloatArray
) -> None:
    """Filter a series (2, n) with constant gains over samples first..stop - 1: one short chain of sums for each sample.

    m (5, 7) maps the state, of which (y, p, w) are used, and both samples to the next state; gain is the rate's by the angle.
    """
    yy, yp, yw, ya, yr = m[0, 0], m[0, 1], m[0, 2], m[0, 5], m[0, 6]
    py, pp, pw, pa, pr = m[1, 0], m[1, 1], m[1, 2], m[1, 5], m[1, 6]
    wy, wp, ww, wa, wr = m[2, 0], m[2, 1], m[2, 2], m[2, 5], m[2, 6]
    y, p, w, of_angle, of_rate = state[0], state[1], state[2], roots[0], roots[1]
    for i in range(first, stop):
        angle, rate = series[0, i], series[1, i]
        e = angle - y
        out[0, i], out[1, i] = e * of_angle, (rate - p - gain * e) * of_rate
        y, p, w = (
            (yy * y + yp * p) + (yw * w + (ya * angle + yr * rate)),
            (py * y + pp * p) + (pw * w + (pa * angle + pr * rate)),
            (wy * y + wp * p) + (ww * w + (wa * angle + wr * rate)),
        )
    state[0], state[1], state[2] = y, p, w


@inner
def _settled_with_sensors(
    series: FloatArray, out: FloatArray, first: int, stop: int, state: FloatArray, m: FloatArray, gain: float, roots: FloatArray
) -> None:
    """Do what `_settled` does with all five states."""
    y, p, w, n_y, n_p, of_angle, of_rate = state[0], state[1], state[2], state[3], state[4], roots[0], roots[1]
    for i in range(first, stop):
        angle, rate = series[0, i], series[1, i]
        e = angle - y - n_y
        out[0, i], out[1, i] = e * of_angle, (rate - p - n_p - gain * e) * of_rate
        y, p, w, n_y, n_p = (
            (m[0, 0] * y + m[0, 1] * p) + (m[0, 2] * w + (m[0, 3] * n_y + m[0, 4] * n_p)) + (m[0, 5] * angle + m[0, 6] * rate),
            (m[1, 0] * y + m[1, 1] * p) + (m[1, 2] * w + (m[1, 3] * n_y + m[1, 4] * n_p)) + (m[1, 5] * angle + m[1, 6] * rate),
            (m[2, 0] * y + m[2, 1] * p) + (m[2, 2] * w + (m[2, 3] * n_y + m[2, 4] * n_p)) + (m[2, 5] * angle + m[2, 6] * rate),
            (m[3, 0] * y + m[3, 1] * p) + (m[3, 2] * w + (m[3, 3] * n_y + m[3, 4] * n_p)) + (m[3, 5] * angle + m[3, 6] * rate),
            (m[4, 0] * y + m[4, 1] * p) + (m[4, 2] * w + (m[4, 3] * n_y + m[4, 4] * n_p)) + (m[4, 5] * angle + m[4, 6] * rate),
        )
    state[0], state[1], state[2], state[3], state[4] = y, p, w, n_y, n_p


@inner
def _moved(
    room: FloatArray, l: int, at: int, lanes: int, coloured: bool, angle: float, rate: float,
    yy: float, yp: float, py: float, pp: float, yw: float, pw: float,
) -> None:  # fmt: skip
    """Take both samples into the state at a place of the room, by the gains of noise l, and move it on to the next instant."""
    y, p, w, m, q = room[at], room[at + lanes], room[at + 2 * lanes], room[at + 3 * lanes], room[at + 4 * lanes]
    e = angle - y - m
    room[at + 5 * lanes] = e * room[ROOTS * lanes + l]
    y, p, w, m, q = _corrected(e, room, GAINS * lanes + l, lanes, coloured, y, p, w, m, q)
    e = rate - p - q
    room[at + 6 * lanes] = e * room[(ROOTS + 1) * lanes + l]
    y, p, w, m, q = _corrected(e, room, (GAINS + 5) * lanes + l, lanes, coloured, y, p, w, m, q)
    room[at], room[at + lanes], room[at + 2 * lanes] = (
        yy * y + yp * p + yw * w,
        py * y + pp * p + pw * w,
        room[KEPT * lanes + l] * w,
    )
    if coloured:
        mm = room[(KEPT + 1) * lanes + l]
        room[at + 3 * lanes], room[at + 4 * lanes] = mm * m, mm * q


def _compiled(lanes: int, *, coloured: bool) -> Filter:
    """Return the filter of so many noises abreast, with states for the colour of the sensors or without."""
    own = 3 if coloured else 0

    @jit
    def run(
        steps: FloatArray, ok: BoolArray, a: float, k: float, noises: FloatArray,
        series: FloatArray, out: FloatArray, spreads: FloatArray,
    ) -> float:  # fmt: skip
        """Fill out (m, 2, n) with the standardised innovations of series (m, 2, n), spreads (L, 2, n) with their deviations.

        noises is (L, 7) in the order of NOISE_FIELDS; eight noises have one series, and m is eight. Samples not measured give
        zero and one. Returns the sum of the log variances under the first noise. Once a few steps in a row of equal length
        leave the gains as they are, they are kept until a sample is missing or the step changes.
        """
        n, count = steps.shape[0] + 1, out.shape[0]
        # one flat array of rows at known places: only so is the compiler sure that no lane writes what another reads
        room = np.zeros(ROWS * lanes + (ROWS - STATE) * count)
        for l in range(lanes):
            room[WHITE * lanes + l], room[(WHITE + 1) * lanes + l] = noises[l, 0] ** 2, noises[l, 1] ** 2
            room[(WANDER + 2) * lanes + l] = noises[l, 2] ** 2
            room[(WANDER + own) * lanes + l], room[(WANDER + own + 1) * lanes + l] = noises[l, 4] ** 2, noises[l, 5] ** 2
            for r in range(5):
                room[(5 * r - r * (r - 1) // 2) * lanes + l] = room[(WANDER + r) * lanes + l]
        last, settled, i, logs, sensors_alone = -1.0, 0, 0, 0.0, not coloured and noises[0, 4] + noises[0, 5] > 0.0
        yy, yp, py, pp, yw, pw = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
        while i < n:
            if lanes == 1 and settled >= STEADY_GAIN_STEPS:
                stop, settled, spare, m = _steady_until(steps, ok, i, last), 0, STATE + 7 * count, np.empty((5, 7))
                for c in range(7):
                    room[spare : spare + 5] = 0.0
                    room[spare + c] = 1.0
                    _moved(room, 0, spare, 1, coloured, 1.0 * (c == 5), 1.0 * (c == 6), yy, yp, py, pp, yw, pw)
                    m[:, c] = room[spare : spare + 5]
                gain, roots = room[GAINS + 1] + room[GAINS + 4], room[ROOTS : ROOTS + 2]
                for j in range(count):
                    state = room[STATE + 7 * j : STATE + 7 * j + 5]
                    if coloured:
                        _settled_with_sensors(series[j], out[j], i, stop, state, m, gain, roots)
                    else:
                        _settled(series[j], out[j], i, stop, state, m, gain, roots)
                spreads[0, 0, i:stop], spreads[0, 1, i:stop] = 1.0 / roots[0], 1.0 / roots[1]
                logs -= 2.0 * (stop - i) * np.log(roots[0] * roots[1])
                i = stop
                continue
            seen, felt, still = 1.0 * ok[0, i], 1.0 * ok[1, i], ok[0, i] and ok[1, i]
            if i < n - 1 and is_other_step(steps[i], last):
                still, last = False, steps[i]
                yy, yp, py, pp, yw, pw = transition(a, k, last)
                for l in range(lanes):
                    ww, mm = np.exp(-last / noises[l, 3]), np.exp(-last / noises[l, 6])
                    room[KEPT * lanes + l], room[(KEPT + 1) * lanes + l] = ww, mm
                    for r in range(5):
                        part = 1.0 - (ww * ww if r == 2 else mm * mm)
                        room[(ADDED + r) * lanes + l] = room[(WANDER + r) * lanes + l] * part
                if sensors_alone:
                    yy, yp, py, pp, yw, pw = room[KEPT + 1], 0.0, 0.0, room[KEPT + 1], 0.0, 0.0
            for l in range(lanes):
                c00, c01, c02 = room[l], room[lanes + l], room[2 * lanes + l]
                c11, c12, c22 = room[5 * lanes + l], room[6 * lanes + l], room[9 * lanes + l]
                r0, r1, r2, r3, r4, a3, a4, b3, b4 = c00, c01, c02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                if coloured:
                    c03, c04, c13, c14 = room[3 * lanes + l], room[4 * lanes + l], room[7 * lanes + l], room[8 * lanes + l]
                    c23, c24, c33 = room[10 * lanes + l], room[11 * lanes + l], room[12 * lanes + l]
                    c34, c44 = room[13 * lanes + l], room[14 * lanes + l]
                    r0, r1, r2, r3, r4 = c00 + c03, c01 + c13, c02 + c23, c03 + c33, c04 + c34
                share = seen / (r0 + r3 + room[WHITE * lanes + l])
                root = np.sqrt(share)
                a0, a1, a2, c00, c01, c02, c11, c12, c22 = _learnt(r0, r1, r2, share, c00, c01, c02, c11, c12, c22)
                if coloured:
                    a3, a4, c03, c04, c13, c14, c23, c24, c33, c34, c44 = _learnt_of_sensors(
                        r0, r1, r2, r3, r4, share, c03, c04, c13, c14, c23, c24, c33, c34, c44
                    )
                r0, r1, r2 = c01, c11, c12
                if coloured:
                    r0, r1, r2, r3, r4 = c01 + c04, c11 + c14, c12 + c24, c13 + c34, c14 + c44
                share = felt / (r1 + r4 + room[(WHITE + 1) * lanes + l])
                b0, b1, b2, c00, c01, c02, c11, c12, c22 = _learnt(r0, r1, r2, share, c00, c01, c02, c11, c12, c22)
                if coloured:
                    b3, b4, c03, c04, c13, c14, c23, c24, c33, c34, c44 = _learnt_of_sensors(
                        r0, r1, r2, r3, r4, share, c03, c04, c13, c14, c23, c24, c33, c34, c44
                    )
                if lanes == 1:
                    still = (
                        still and _repeats(a0, room[GAINS]) and _repeats(a1, room[GAINS + 1]) and _repeats(a2, room[GAINS + 2])
                    )
                    still = still and _repeats(b0, room[GAINS + 5]) and _repeats(b1, room[GAINS + 6])
                    still = still and _repeats(b2, room[GAINS + 7])
                if lanes == 1 and coloured:
                    still = still and _repeats(a3, room[GAINS + 3]) and _repeats(a4, room[GAINS + 4])
                    still = still and _repeats(b3, room[GAINS + 8]) and _repeats(b4, room[GAINS + 9])
                room[ROOTS * lanes + l], room[(ROOTS + 1) * lanes + l] = root, np.sqrt(share)
                at = GAINS * lanes + l
                room[at], room[at + lanes], room[at + 2 * lanes] = a0, a1, a2
                room[at + 5 * lanes], room[at + 6 * lanes], room[at + 7 * lanes] = b0, b1, b2
                if coloured:
                    room[at + 3 * lanes], room[at + 4 * lanes] = a3, a4
                    room[at + 8 * lanes], room[at + 9 * lanes] = b3, b4
                ww, mm = room[KEPT * lanes + l], room[(KEPT + 1) * lanes + l]
                u0, u1, u2 = yy * c00 + yp * c01 + yw * c02, yy * c01 + yp * c11 + yw * c12, yy * c02 + yp * c12 + yw * c22
                v0, v1, v2 = py * c00 + pp * c01 + pw * c02, py * c01 + pp * c11 + pw * c12, py * c02 + pp * c12 + pw * c22
                room[l] = u0 * yy + u1 * yp + u2 * yw + room[ADDED * lanes + l]
                room[lanes + l], room[2 * lanes + l], room[6 * lanes + l] = u0 * py + u1 * pp + u2 * pw, u2 * ww, v2 * ww
                room[5 * lanes + l] = v0 * py + v1 * pp + v2 * pw + room[(ADDED + 1) * lanes + l]
                room[9 * lanes + l] = c22 * ww * ww + room[(ADDED + 2) * lanes + l]
                if coloured:
                    room[3 * lanes + l] = (yy * c03 + yp * c13 + yw * c23) * mm
                    room[4 * lanes + l] = (yy * c04 + yp * c14 + yw * c24) * mm
                    room[7 * lanes + l] = (py * c03 + pp * c13 + pw * c23) * mm
                    room[8 * lanes + l] = (py * c04 + pp * c14 + pw * c24) * mm
                    room[10 * lanes + l], room[11 * lanes + l], room[13 * lanes + l] = c23 * ww * mm, c24 * ww * mm, c34 * mm * mm
                    room[12 * lanes + l] = c33 * mm * mm + room[(ADDED + 3) * lanes + l]
                    room[14 * lanes + l] = c44 * mm * mm + room[(ADDED + 4) * lanes + l]
            if lanes == 1:
                for j in range(count):
                    _moved(room, 0, STATE + 7 * j, 1, coloured, series[j, 0, i], series[j, 1, i], yy, yp, py, pp, yw, pw)
            else:
                angle, rate = series[0, 0, i], series[0, 1, i]
                for l in range(lanes):
                    _moved(room, l, STATE * lanes + l, lanes, coloured, angle, rate, yy, yp, py, pp, yw, pw)
            for j in range(count):
                at = STATE * lanes + (j if lanes > 1 else 7 * j)
                out[j, 0, i], out[j, 1, i] = room[at + 5 * lanes], room[at + 6 * lanes]
            for l in range(lanes):
                spreads[l, 0, i] = 1.0 / room[ROOTS * lanes + l] if ok[0, i] else 1.0
                spreads[l, 1, i] = 1.0 / room[(ROOTS + 1) * lanes + l] if ok[1, i] else 1.0
            logs += 2.0 * np.log(spreads[0, 0, i] * spreads[0, 1, i])
            settled = settled + 1 if still else 0
            i += 1
        return logs

    return run


three_states, with_sensors = _compiled(1, coloured=False), _compiled(1, coloured=True)
with_sensors_abreast = _compiled(LANES, coloured=True)
