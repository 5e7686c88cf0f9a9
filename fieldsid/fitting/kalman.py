"""The compiled Kalman filter of the motion that disturbances and coloured sensor noise cause.

State (y, p, w, n_y, n_p), see fitting/whitening.py; a noise is a vector (7,) in the order of whitening.NOISE_FIELDS.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.kalman_waking import waking, waking_of_both, waking_of_sensors
from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit


@jit
def _moving(noise: FloatArray) -> tuple[int, int]:
    """Return the first and one past the last of the states that are not zero for good under a noise (7,)."""
    coloured = noise[4] > 0.0 or noise[5] > 0.0
    return (0 if noise[2] > 0.0 or not coloured else 3), (5 if coloured else 3)


@jit
def _settled_until(steps: FloatArray, ok: npt.NDArray[np.bool_], first: int, h: float) -> int:
    """Return the first sample from `first` on that is not measured in full or not followed by a step of h."""
    n = steps.shape[0] + 1
    i = first
    while i < n and ok[0, i] and ok[1, i] and (i == n - 1 or abs(steps[i] - h) <= 1e-7 * h):
        i += 1
    return i


@jit
def _combined(gain: FloatArray, f: FloatArray, low: int, m: FloatArray) -> None:
    """Fill m (3, 5) with one settled step of the three states of `_short_stretch`: by themselves and by both samples."""
    i, j = low, low + 1
    for c in range(5):
        y, p, w = 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2)
        e = 1.0 * (c == 3) - y
        y, p, w = y + gain[0, i] * e, p + gain[0, j] * e, w + gain[0, 2] * e
        e = 1.0 * (c == 4) - p
        y, p, w = y + gain[1, i] * e, p + gain[1, j] * e, w + gain[1, 2] * e
        m[0, c] = f[i, i] * y + f[i, j] * p + f[i, 2] * w
        m[1, c] = f[j, i] * y + f[j, j] * p + f[j, 2] * w
        m[2, c] = f[2, 2] * w


@jit
def _short_stretch(
    series: FloatArray, out: FloatArray, first: int, stop: int, m: FloatArray, push: float, spread: FloatArray, state: FloatArray,
    low: int,
) -> None:  # fmt: skip
    """Do what `_stretch` does where either the sensors or the motion alone is noisy, in one short chain of sums a sample.

    The states are (y, p, w) or (n_y, n_p, 0); m (3, 5) is their combined step, push the gain of the rate's by the angle.
    """
    y, p, w = state[low], state[low + 1], state[2]
    yy, yp, yw, ya, yr = m[0, 0], m[0, 1], m[0, 2], m[0, 3], m[0, 4]
    py, pp, pw, pa, pr = m[1, 0], m[1, 1], m[1, 2], m[1, 3], m[1, 4]
    wy, wp, ww, wa, wr = m[2, 0], m[2, 1], m[2, 2], m[2, 3], m[2, 4]
    of_angle, of_rate = 1.0 / spread[0], 1.0 / spread[1]
    for i in range(first, stop):
        angle, rate = series[0, i], series[1, i]
        e = angle - y
        out[0, i] = e * of_angle
        out[1, i] = (rate - p - push * e) * of_rate
        y, p, w = (
            (yy * y + yp * p) + (yw * w + (ya * angle + yr * rate)),
            (py * y + pp * p) + (pw * w + (pa * angle + pr * rate)),
            (wy * y + wp * p) + (ww * w + (wa * angle + wr * rate)),
        )
    state[low], state[low + 1], state[2] = y, p, w


@jit
def _stretch(
    series: FloatArray, out: FloatArray, first: int, stop: int,
    gain: FloatArray, f: FloatArray, spread: FloatArray, state: FloatArray,
) -> None:  # fmt: skip
    """Filter one series (2, n) over samples first..stop - 1 with gains that stay; state (5,) is left before `stop`."""
    y, p, w, m, q = state[0], state[1], state[2], state[3], state[4]
    a0, a1, a2, a3, a4 = gain[0, 0], gain[0, 1], gain[0, 2], gain[0, 3], gain[0, 4]
    b0, b1, b2, b3, b4 = gain[1, 0], gain[1, 1], gain[1, 2], gain[1, 3], gain[1, 4]
    yy, yp, yw, py, pp, pw = f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2]
    ww, mm, qq = f[2, 2], f[3, 3], f[4, 4]
    of_angle, of_rate = 1.0 / spread[0], 1.0 / spread[1]
    for i in range(first, stop):
        e = series[0, i] - y - m
        out[0, i] = e * of_angle
        y, p, w, m, q = y + a0 * e, p + a1 * e, w + a2 * e, m + a3 * e, q + a4 * e
        e = series[1, i] - p - q
        out[1, i] = e * of_rate
        y, p, w, m, q = y + b0 * e, p + b1 * e, w + b2 * e, m + b3 * e, q + b4 * e
        y, p, w, m, q = yy * y + yp * p + yw * w, py * y + pp * p + pw * w, ww * w, mm * m, qq * q
    state[0], state[1], state[2], state[3], state[4] = y, p, w, m, q


@jit
def _settled(
    series: FloatArray, out: FloatArray, first: int, stop: int,
    gain: FloatArray, f: FloatArray, spread: FloatArray, state: FloatArray, low: int, high: int,
) -> None:  # fmt: skip
    """Filter every series (m, 2, n) over samples first..stop - 1 with gains that stay; state (m, 5)."""
    m = np.empty((3, 5))
    _combined(gain, f, low, m)
    for j in range(series.shape[0]):
        if high - low < 5:
            _short_stretch(series[j], out[j], first, stop, m, gain[0, low + 1], spread, state[j], low)
        else:
            _stretch(series[j], out[j], first, stop, gain, f, spread, state[j])


@jit
def filtered(
    steps: FloatArray,
    ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    series: FloatArray,
    out: FloatArray,
    spreads: FloatArray,
) -> float:
    """Do what `innovations` does, and fill spreads (2, n) with their standard deviations, one where not measured."""
    n = steps.shape[0] + 1
    cov, f, gain, spread = np.zeros((5, 5)), np.zeros((5, 5)), np.zeros((2, 5)), np.empty(2)
    state = np.zeros((series.shape[0], 5))
    cov[2, 2], cov[3, 3], cov[4, 4] = noise[2] ** 2, noise[4] ** 2, noise[5] ** 2
    low, high = _moving(noise)
    log_sum, logs, last_h, is_settled = 0.0, 0.0, -1.0, False
    i = min(0, n)  # no literal: everything called with one is compiled once more
    while i < n:
        if is_settled:
            stop = _settled_until(steps, ok, i, last_h)
            _settled(series, out, i, stop, gain, f, spread, state, low, high)
            for ch in range(2):
                for l in range(i, stop):
                    spreads[ch, l] = spread[ch]
                log_sum += 2.0 * (stop - i) * np.log(spread[ch])
            i, is_settled = stop, False
            continue
        if low > 0:
            i, logs, last_h = waking_of_sensors(
                steps, ok, i, last_h, a, k, noise, series, out, spreads, cov, f, gain, spread, state
            )
        elif high < 5:
            i, logs, last_h = waking(steps, ok, i, last_h, a, k, noise, series, out, spreads, cov, f, gain, spread, state)
        else:
            i, logs, last_h = waking_of_both(steps, ok, i, last_h, a, k, noise, series, out, spreads, cov, f, gain, spread, state)
        log_sum, is_settled = log_sum + logs, True
    return log_sum


def innovations(
    steps: FloatArray,
    ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    series: FloatArray,
    out: FloatArray,
) -> float:
    """Fill out (m, 2, n) with the standardised innovations of series (m, 2, n); return the sum of log variances.

    Samples not measured give zero. Once four steps in a row of equal length leave the gains as they are, they are kept
    until a sample is missing or the step changes.
    """
    return filtered(steps, ok, a, k, noise, series, out, np.empty((2, steps.shape[0] + 1)))
