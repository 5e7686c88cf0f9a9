"""The compiled Kalman filter of the motion that noise causes, which takes the two samples of an instant one after the other.

State (y, p, w, n_y, n_p) of noise/whiten.py, its covariance stored as the 15 numbers of a symmetric matrix. One source is
compiled three times: with all five states; with five states for eight noises in parallel, which the processor vectorises; and
with three states (y, p, w), where there is only a disturbance or only coloured sensor noise. In the latter case n_y and n_p take
the places of y and p. Source: Koopman and Durbin 2000, Fast filtering and smoothing for multivariate state space models, J. Time
Series Analysis 21(3).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldsid.noise.kalman.transition import is_other_step, transition
from fieldsid.numerics.arrays import BoolArray, FloatArray
from fieldsid.numerics.jit import inner, jit

Filter = Callable[[FloatArray, BoolArray, float, float, FloatArray, FloatArray, FloatArray, FloatArray], float]

STEADY_GAIN_STEPS = 4
"""Number of consecutive steps with unchanged gains after which the gains are taken as constant."""
LANES = 8
"""Number of noises that are filtered in parallel."""
GAINS, ROOTS, WHITE, WANDER, ADDED, DECAYS, STATE, ROWS = 15, 25, 27, 29, 34, 39, 41, 48
"""First rows of each quantity in the work array, after the 15 rows of the covariance; a row has one number for each noise."""


@inner
def _measured(
    r0: float, r1: float, r2: float, share: float, c00: float, c01: float, c02: float, c11: float, c12: float, c22: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return the Kalman gains of (y, p, w) for one sample, and their covariance after it.

    r are the covariances of the sample with (y, p, w); share is one over the variance of the sample, zero where it was not
    measured.
    """
    g0, g1, g2 = r0 * share, r1 * share, r2 * share
    return g0, g1, g2, c00 - g0 * r0, c01 - g0 * r1, c02 - g0 * r2, c11 - g1 * r1, c12 - g1 * r2, c22 - g2 * r2


@inner
def _measured_sensors(
    r0: float, r1: float, r2: float, r3: float, r4: float, share: float,
    c03: float, c04: float, c13: float, c14: float, c23: float, c24: float, c33: float, c34: float, c44: float,
) -> tuple[float, float, float, float, float, float, float, float, float, float, float]:  # fmt: skip
    """Return the Kalman gains of (n_y, n_p) for one sample, and their covariances with the state after it."""
    g3, g4, s3, s4 = r3 * share, r4 * share, r3 * share, r4 * share
    return (
        g3, g4, c03 - r0 * s3, c04 - r0 * s4, c13 - r1 * s3, c14 - r1 * s4, c23 - r2 * s3, c24 - r2 * s4,
        c33 - g3 * r3, c34 - g3 * r4, c44 - g4 * r4,
    )  # fmt: skip


@inner
def _corrected_state(
    e: float, work: FloatArray, at: int, lanes: int, coloured: bool, y: float, p: float, w: float, m: float, q: float
) -> tuple[float, float, float, float, float]:
    """Return the state after a sample of innovation e; its gains begin at index `at` of the work array."""
    y, p, w = y + work[at] * e, p + work[at + lanes] * e, w + work[at + 2 * lanes] * e
    return (y, p, w, m + work[at + 3 * lanes] * e, q + work[at + 4 * lanes] * e) if coloured else (y, p, w, m, q)


@inner
def _repeats(gain: float, last: float) -> bool:
    """Whether a gain equals that of the previous sample."""
    return abs(gain - last) < 1e-7 * (abs(gain) + 1e-6)


@inner
def _steady_until(steps: FloatArray, ok: BoolArray, first: int, h: float) -> int:
    """Return the first sample from `first` on at which a channel is missing or which is not followed by a step of h."""
    n, i = steps.shape[0] + 1, first
    while i < n and ok[0, i] and ok[1, i] and (i == n - 1 or not is_other_step(steps[i], h)):
        i += 1
    return i


@inner
def _filter_steady(
    series: FloatArray, out: FloatArray, first: int, stop: int, state: FloatArray, m: FloatArray, gain: float, roots: FloatArray
) -> None:
    """Filter a series (2, n) with constant gains over samples first..stop - 1: one short chain of sums for each sample.

    m (5, 7) maps the state, of which (y, p, w) are used, and both samples to the next state; gain is the share of the angle's
    innovation that is subtracted from the rate's.
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
def _filter_steady_with_sensors(
    series: FloatArray, out: FloatArray, first: int, stop: int, state: FloatArray, m: FloatArray, gain: float, roots: FloatArray
) -> None:
    """Filter a series with constant gains as `_filter_steady` does, with all five states."""
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
def _update_and_predict(
    work: FloatArray, l: int, at: int, lanes: int, coloured: bool, angle: float, rate: float,
    yy: float, yp: float, py: float, pp: float, yw: float, pw: float,
) -> None:  # fmt: skip
    """Update the state at index `at` of the work array by both samples, with the gains of noise l, and predict the next."""
    y, p, w, m, q = work[at], work[at + lanes], work[at + 2 * lanes], work[at + 3 * lanes], work[at + 4 * lanes]
    e = angle - y - m
    work[at + 5 * lanes] = e * work[ROOTS * lanes + l]
    y, p, w, m, q = _corrected_state(e, work, GAINS * lanes + l, lanes, coloured, y, p, w, m, q)
    e = rate - p - q
    work[at + 6 * lanes] = e * work[(ROOTS + 1) * lanes + l]
    y, p, w, m, q = _corrected_state(e, work, (GAINS + 5) * lanes + l, lanes, coloured, y, p, w, m, q)
    work[at], work[at + lanes], work[at + 2 * lanes] = (
        yy * y + yp * p + yw * w,
        py * y + pp * p + pw * w,
        work[DECAYS * lanes + l] * w,
    )
    if coloured:
        mm = work[(DECAYS + 1) * lanes + l]
        work[at + 3 * lanes], work[at + 4 * lanes] = mm * m, mm * q


def _compiled(lanes: int, *, coloured: bool) -> Filter:
    """Return the filter of `lanes` noises in parallel, with or without states for coloured sensor noise."""
    first_sensor = 3 if coloured else 0

    @jit
    def run(
        steps: FloatArray, ok: BoolArray, a: float, k: float, noises: FloatArray,
        series: FloatArray, out: FloatArray, spreads: FloatArray,
    ) -> float:  # fmt: skip
        """Fill out (m, 2, n) with the standardised innovations of series (m, 2, n), spreads (L, 2, n) with their deviations.

        noises is (L, 7) in the order of NOISE_FIELDS; eight noises have one series, and m is eight. Samples not measured give
        zero and one. Returns the sum of the log variances under the first noise. Once the gains are unchanged over a few
        consecutive steps of equal length, they are taken as constant until a sample is missing or the step changes.
        """
        n, count = steps.shape[0] + 1, out.shape[0]
        # one flat work array with fixed offsets: only so can the compiler prove that no lane writes what another reads
        work = np.zeros(ROWS * lanes + (ROWS - STATE) * count)
        for l in range(lanes):
            work[WHITE * lanes + l], work[(WHITE + 1) * lanes + l] = noises[l, 0] ** 2, noises[l, 1] ** 2
            work[(WANDER + 2) * lanes + l] = noises[l, 2] ** 2
            work[(WANDER + first_sensor) * lanes + l], work[(WANDER + first_sensor + 1) * lanes + l] = (
                noises[l, 4] ** 2,
                noises[l, 5] ** 2,
            )
            for r in range(5):
                work[(5 * r - r * (r - 1) // 2) * lanes + l] = work[(WANDER + r) * lanes + l]
        last, settled, i, logs, sensors_alone = -1.0, 0, 0, 0.0, not coloured and noises[0, 4] + noises[0, 5] > 0.0
        yy, yp, py, pp, yw, pw = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
        while i < n:
            if lanes == 1 and settled >= STEADY_GAIN_STEPS:
                stop, settled, spare, m = _steady_until(steps, ok, i, last), 0, STATE + 7 * count, np.empty((5, 7))
                for c in range(7):
                    work[spare : spare + 5] = 0.0
                    work[spare + c] = 1.0
                    _update_and_predict(work, 0, spare, 1, coloured, 1.0 * (c == 5), 1.0 * (c == 6), yy, yp, py, pp, yw, pw)
                    m[:, c] = work[spare : spare + 5]
                gain, roots = work[GAINS + 1] + work[GAINS + 4], work[ROOTS : ROOTS + 2]
                for j in range(count):
                    state = work[STATE + 7 * j : STATE + 7 * j + 5]
                    if coloured:
                        _filter_steady_with_sensors(series[j], out[j], i, stop, state, m, gain, roots)
                    else:
                        _filter_steady(series[j], out[j], i, stop, state, m, gain, roots)
                spreads[0, 0, i:stop], spreads[0, 1, i:stop] = 1.0 / roots[0], 1.0 / roots[1]
                logs -= 2.0 * (stop - i) * np.log(roots[0] * roots[1])
                i = stop
                continue
            seen, rate_seen, is_steady = 1.0 * ok[0, i], 1.0 * ok[1, i], ok[0, i] and ok[1, i]
            if i < n - 1 and is_other_step(steps[i], last):
                is_steady, last = False, steps[i]
                yy, yp, py, pp, yw, pw = transition(a, k, last)
                for l in range(lanes):
                    ww, mm = np.exp(-last / noises[l, 3]), np.exp(-last / noises[l, 6])
                    work[DECAYS * lanes + l], work[(DECAYS + 1) * lanes + l] = ww, mm
                    for r in range(5):
                        part = 1.0 - (ww * ww if r == 2 else mm * mm)
                        work[(ADDED + r) * lanes + l] = work[(WANDER + r) * lanes + l] * part
                if sensors_alone:
                    yy, yp, py, pp, yw, pw = work[DECAYS + 1], 0.0, 0.0, work[DECAYS + 1], 0.0, 0.0
            for l in range(lanes):
                c00, c01, c02 = work[l], work[lanes + l], work[2 * lanes + l]
                c11, c12, c22 = work[5 * lanes + l], work[6 * lanes + l], work[9 * lanes + l]
                r0, r1, r2, r3, r4, a3, a4, b3, b4 = c00, c01, c02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                if coloured:
                    c03, c04, c13, c14 = work[3 * lanes + l], work[4 * lanes + l], work[7 * lanes + l], work[8 * lanes + l]
                    c23, c24, c33 = work[10 * lanes + l], work[11 * lanes + l], work[12 * lanes + l]
                    c34, c44 = work[13 * lanes + l], work[14 * lanes + l]
                    r0, r1, r2, r3, r4 = c00 + c03, c01 + c13, c02 + c23, c03 + c33, c04 + c34
                share = seen / (r0 + r3 + work[WHITE * lanes + l])
                root = np.sqrt(share)
                a0, a1, a2, c00, c01, c02, c11, c12, c22 = _measured(r0, r1, r2, share, c00, c01, c02, c11, c12, c22)
                if coloured:
                    a3, a4, c03, c04, c13, c14, c23, c24, c33, c34, c44 = _measured_sensors(
                        r0, r1, r2, r3, r4, share, c03, c04, c13, c14, c23, c24, c33, c34, c44
                    )
                r0, r1, r2 = c01, c11, c12
                if coloured:
                    r0, r1, r2, r3, r4 = c01 + c04, c11 + c14, c12 + c24, c13 + c34, c14 + c44
                share = rate_seen / (r1 + r4 + work[(WHITE + 1) * lanes + l])
                b0, b1, b2, c00, c01, c02, c11, c12, c22 = _measured(r0, r1, r2, share, c00, c01, c02, c11, c12, c22)
                if coloured:
                    b3, b4, c03, c04, c13, c14, c23, c24, c33, c34, c44 = _measured_sensors(
                        r0, r1, r2, r3, r4, share, c03, c04, c13, c14, c23, c24, c33, c34, c44
                    )
                if lanes == 1:
                    is_steady = (
                        is_steady
                        and _repeats(a0, work[GAINS])
                        and _repeats(a1, work[GAINS + 1])
                        and _repeats(a2, work[GAINS + 2])
                    )
                    is_steady = is_steady and _repeats(b0, work[GAINS + 5]) and _repeats(b1, work[GAINS + 6])
                    is_steady = is_steady and _repeats(b2, work[GAINS + 7])
                if lanes == 1 and coloured:
                    is_steady = is_steady and _repeats(a3, work[GAINS + 3]) and _repeats(a4, work[GAINS + 4])
                    is_steady = is_steady and _repeats(b3, work[GAINS + 8]) and _repeats(b4, work[GAINS + 9])
                work[ROOTS * lanes + l], work[(ROOTS + 1) * lanes + l] = root, np.sqrt(share)
                at = GAINS * lanes + l
                work[at], work[at + lanes], work[at + 2 * lanes] = a0, a1, a2
                work[at + 5 * lanes], work[at + 6 * lanes], work[at + 7 * lanes] = b0, b1, b2
                if coloured:
                    work[at + 3 * lanes], work[at + 4 * lanes] = a3, a4
                    work[at + 8 * lanes], work[at + 9 * lanes] = b3, b4
                ww, mm = work[DECAYS * lanes + l], work[(DECAYS + 1) * lanes + l]
                u0, u1, u2 = yy * c00 + yp * c01 + yw * c02, yy * c01 + yp * c11 + yw * c12, yy * c02 + yp * c12 + yw * c22
                v0, v1, v2 = py * c00 + pp * c01 + pw * c02, py * c01 + pp * c11 + pw * c12, py * c02 + pp * c12 + pw * c22
                work[l] = u0 * yy + u1 * yp + u2 * yw + work[ADDED * lanes + l]
                work[lanes + l], work[2 * lanes + l], work[6 * lanes + l] = u0 * py + u1 * pp + u2 * pw, u2 * ww, v2 * ww
                work[5 * lanes + l] = v0 * py + v1 * pp + v2 * pw + work[(ADDED + 1) * lanes + l]
                work[9 * lanes + l] = c22 * ww * ww + work[(ADDED + 2) * lanes + l]
                if coloured:
                    work[3 * lanes + l] = (yy * c03 + yp * c13 + yw * c23) * mm
                    work[4 * lanes + l] = (yy * c04 + yp * c14 + yw * c24) * mm
                    work[7 * lanes + l] = (py * c03 + pp * c13 + pw * c23) * mm
                    work[8 * lanes + l] = (py * c04 + pp * c14 + pw * c24) * mm
                    work[10 * lanes + l], work[11 * lanes + l], work[13 * lanes + l] = c23 * ww * mm, c24 * ww * mm, c34 * mm * mm
                    work[12 * lanes + l] = c33 * mm * mm + work[(ADDED + 3) * lanes + l]
                    work[14 * lanes + l] = c44 * mm * mm + work[(ADDED + 4) * lanes + l]
            if lanes == 1:
                for j in range(count):
                    _update_and_predict(
                        work, 0, STATE + 7 * j, 1, coloured, series[j, 0, i], series[j, 1, i], yy, yp, py, pp, yw, pw
                    )
            else:
                angle, rate = series[0, 0, i], series[0, 1, i]
                for l in range(lanes):
                    _update_and_predict(work, l, STATE * lanes + l, lanes, coloured, angle, rate, yy, yp, py, pp, yw, pw)
            for j in range(count):
                at = STATE * lanes + (j if lanes > 1 else 7 * j)
                out[j, 0, i], out[j, 1, i] = work[at + 5 * lanes], work[at + 6 * lanes]
            for l in range(lanes):
                spreads[l, 0, i] = 1.0 / work[ROOTS * lanes + l] if ok[0, i] else 1.0
                spreads[l, 1, i] = 1.0 / work[(ROOTS + 1) * lanes + l] if ok[1, i] else 1.0
            logs += 2.0 * np.log(spreads[0, 0, i] * spreads[0, 1, i])
            settled = settled + 1 if is_steady else 0
            i += 1
        return logs

    return run


three_states, with_sensors = _compiled(1, coloured=False), _compiled(1, coloured=True)
with_sensors_in_lanes = _compiled(LANES, coloured=True)
