"""The compiled Kalman filter of the motion that disturbances and coloured sensor noise cause, and its information.

State (y, p, w, n_y, n_p), see fitting/whitening.py; a noise is a vector (7,) in the order of whitening.NOISE_FIELDS.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit

SETTLED = 4
LOG_STEP = 3e-4
"""Relative change of a noise's number whose effect is taken for a derivative."""


@jit
def _taylor(a: float, k: float, s: float, y: float, p: float, w: float) -> tuple[float, float]:
    """Return (y, p) after s under a held moment w, by the series of the exponential to order 8."""
    add_y, add_p, push = y, p, w
    for order in range(1, 9):
        share = s / order
        add_y, add_p = add_p * share, (push - a * add_p - k * add_y) * share
        push = 0.0
        y += add_y
        p += add_p
    return y, p


@jit
def transition(a: float, k: float, h: float) -> tuple[float, float, float, float, float, float]:
    """Return the held-input transition of (y, p) over h: f_yy, f_yp, f_py, f_pp, and what w adds to y and to p."""
    pieces = max(1, int(np.ceil(max(abs(a), np.sqrt(abs(k)), 1e-9) * h / 0.25)))
    s = h / pieces
    yy, yp, py, pp, wy, wp = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    for _ in range(pieces):
        yy, py = _taylor(a, k, s, yy, py, 0.0)
        yp, pp = _taylor(a, k, s, yp, pp, 0.0)
        wy, wp = _taylor(a, k, s, wy, wp, 1.0)
    return yy, yp, py, pp, wy, wp


@jit
def _set_transition(a: float, k: float, h: float, noise: FloatArray, f: FloatArray) -> None:
    """Fill f (5, 5) with the transition of (y, p, w, n_y, n_p) over h."""
    f[0, 0], f[0, 1], f[1, 0], f[1, 1], f[0, 2], f[1, 2] = transition(a, k, h)
    f[2, 2] = np.exp(-h / noise[3])
    f[3, 3] = f[4, 4] = np.exp(-h / noise[6])


@jit
def _moving(noise: FloatArray) -> tuple[int, int]:
    """Return the first and one past the last of the states that are not zero for good under a noise (7,)."""
    coloured = noise[4] > 0.0 or noise[5] > 0.0
    return (0 if noise[2] > 0.0 or not coloured else 3), (5 if coloured else 3)


@jit
def _correct(cov: FloatArray, channel: int, white: float, gain: FloatArray, row: FloatArray, low: int, high: int) -> float:
    """Take one channel's measurement into cov (5, 5); fill its gain (2, 5); return its innovation's spread."""
    other = channel + 3
    for l in range(low, high):
        row[l] = cov[channel, l] + cov[other, l]
    var = row[channel] + row[other] + white
    for l in range(low, high):
        gain[channel, l] = row[l] / var
    for l in range(low, high):
        for q in range(low, high):
            cov[l, q] -= gain[channel, l] * row[q]
    return float(np.sqrt(var))


@jit
def _advance(cov: FloatArray, f: FloatArray, fp: FloatArray, noise: FloatArray, low: int, high: int) -> None:
    """Carry cov (5, 5) over one interval in place; fp (5, 5) is room to work in. Only f[:2, :3] is not diagonal."""
    for l in range(low, high):
        for q in range(low, high):
            if l < 2:
                fp[l, q] = f[l, 0] * cov[0, q] + f[l, 1] * cov[1, q] + f[l, 2] * cov[2, q]
            else:
                fp[l, q] = f[l, l] * cov[l, q]
    for l in range(low, high):
        for q in range(low, high):
            if q < 2:
                cov[l, q] = fp[l, 0] * f[q, 0] + fp[l, 1] * f[q, 1] + fp[l, 2] * f[q, 2]
            else:
                cov[l, q] = fp[l, q] * f[q, q]
    cov[2, 2] += noise[2] ** 2 * (1.0 - f[2, 2] ** 2)
    cov[3, 3] += noise[4] ** 2 * (1.0 - f[3, 3] ** 2)
    cov[4, 4] += noise[5] ** 2 * (1.0 - f[4, 4] ** 2)


@jit
def _moved(gain: FloatArray, last: FloatArray, low: int, high: int) -> float:
    """Return the largest relative change of the gains (2, 5) since `last`, which becomes them."""
    moved = 0.0
    for ch in range(2):
        for l in range(low, high):
            moved = max(moved, abs(gain[ch, l] - last[ch, l]) / (abs(gain[ch, l]) + 1e-6))
            last[ch, l] = gain[ch, l]
    return moved


@jit
def _settled_until(
    steps: FloatArray, angle_ok: npt.NDArray[np.bool_], rate_ok: npt.NDArray[np.bool_], first: int, h: float
) -> int:
    """Return the first sample from `first` on that is not measured in full or not followed by a step of h."""
    n = steps.shape[0] + 1
    i = first
    while i < n and angle_ok[i] and rate_ok[i] and (i == n - 1 or abs(steps[i] - h) <= 1e-7 * h):
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
def _take(series: FloatArray, out: FloatArray, i: int, ch: int, gain: FloatArray, spread: float, state: FloatArray) -> None:
    """Take one channel's sample i of every series (m, 2, n) into its state (m, 5)."""
    for j in range(series.shape[0]):
        e = series[j, ch, i] - state[j, ch] - state[j, ch + 3]
        out[j, ch, i] = e / spread
        for l in range(5):
            state[j, l] += gain[ch, l] * e


@jit
def _carry(f: FloatArray, state: FloatArray) -> None:
    """Carry every state (m, 5) over one interval."""
    for j in range(state.shape[0]):
        y, p, w = state[j, 0], state[j, 1], state[j, 2]
        state[j, 0] = f[0, 0] * y + f[0, 1] * p + f[0, 2] * w
        state[j, 1] = f[1, 0] * y + f[1, 1] * p + f[1, 2] * w
        state[j, 2] = f[2, 2] * w
        state[j, 3] *= f[3, 3]
        state[j, 4] *= f[4, 4]


@jit
def filtered(
    steps: FloatArray,
    angle_ok: npt.NDArray[np.bool_],
    rate_ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    series: FloatArray,
    out: FloatArray,
    spreads: FloatArray,
) -> float:
    """Do what `innovations` does, and fill spreads (2, n) with their standard deviations, one where not measured."""
    n, ok = steps.shape[0] + 1, (angle_ok, rate_ok)
    cov, f, fp = np.zeros((5, 5)), np.zeros((5, 5)), np.zeros((5, 5))
    gain, last_gain, spread, row = np.zeros((2, 5)), np.zeros((2, 5)), np.empty(2), np.zeros(5)
    state = np.zeros((series.shape[0], 5))
    cov[2, 2], cov[3, 3], cov[4, 4] = noise[2] ** 2, noise[4] ** 2, noise[5] ** 2
    low, high = _moving(noise)
    log_sum, last_h, settled = 0.0, -1.0, 0
    i = min(0, n)  # no literal: everything called with one is compiled once more
    while i < n:
        if settled >= SETTLED:
            stop = _settled_until(steps, angle_ok, rate_ok, i, last_h)
            _settled(series, out, i, stop, gain, f, spread, state, low, high)
            for ch in range(2):
                for l in range(i, stop):
                    spreads[ch, l] = spread[ch]
                log_sum += 2.0 * (stop - i) * np.log(spread[ch])
            i, settled = stop, 0
            continue
        for ch in range(2):
            spreads[ch, i] = 1.0
            for j in range(series.shape[0]):
                out[j, ch, i] = 0.0
            if ok[ch][i]:
                spreads[ch, i] = spread[ch] = _correct(cov, ch, noise[ch] ** 2, gain, row, low, high)
                log_sum += 2.0 * np.log(spread[ch])
                _take(series, out, i, ch, gain, spread[ch], state)
        if i < n - 1:
            h = steps[i]
            if abs(h - last_h) > 1e-7 * h:
                settled, last_h = 0, h
                _set_transition(a, k, h, noise, f)
            _advance(cov, f, fp, noise, low, high)
            settled = settled + 1 if angle_ok[i] and rate_ok[i] and _moved(gain, last_gain, low, high) < 1e-7 else 0
            _carry(f, state)
        i += 1
    return log_sum


@jit
def innovations(
    steps: FloatArray,
    angle_ok: npt.NDArray[np.bool_],
    rate_ok: npt.NDArray[np.bool_],
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
    return filtered(steps, angle_ok, rate_ok, a, k, noise, series, out, np.empty((2, steps.shape[0] + 1)))


@jit
def information(
    steps: FloatArray,
    angle_ok: npt.NDArray[np.bool_],
    rate_ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    place: npt.NDArray[np.int64],
    residual: FloatArray,
    score: FloatArray,
    fisher: FloatArray,
) -> float:
    """Return the log likelihood of a residual (1, 2, n); add its score (P,) and Fisher information (P, P).

    Both are by the logarithms x of the noise's numbers at `place` (P,), from forward differences of the innovations e
    and the logarithms of their spreads s:
        dl/dx = -sum(ds + e de),  F = sum(2 ds ds' + (de + e ds) (de' + e ds'))
    Source: Harvey 1989, Forecasting, structural time series models and the Kalman filter, section 3.4.5.
    """
    count, n = place.shape[0], steps.shape[0] + 1
    e, spreads = np.empty((1, 2, n)), np.empty((2, n))
    log_sum = filtered(steps, angle_ok, rate_ok, a, k, noise, residual, e, spreads)
    wide, raw = np.empty((count, 2, n)), np.empty((count, 2, n))
    moved_e, moved_spreads, moved = np.empty((1, 2, n)), np.empty((2, n)), noise.copy()
    for c in range(count):
        moved[place[c]] = noise[place[c]] * np.exp(LOG_STEP)
        filtered(steps, angle_ok, rate_ok, a, k, moved, residual, moved_e, moved_spreads)
        moved[place[c]] = noise[place[c]]
        for ch in range(2):
            for i in range(n):
                known = e[0, ch, i]
                wider = (moved_spreads[ch, i] / spreads[ch, i] - 1.0) / LOG_STEP
                slope = (moved_e[0, ch, i] - known) / LOG_STEP
                score[c] -= wider + known * slope
                wide[c, ch, i], raw[c, ch, i] = wider, slope + known * wider
        for d in range(c + 1):
            value = 0.0
            for ch in range(2):
                for i in range(n):
                    value += 2.0 * wide[c, ch, i] * wide[d, ch, i] + raw[c, ch, i] * raw[d, ch, i]
            fisher[c, d] += value
            if d < c:
                fisher[d, c] += value
    for ch in range(2):
        for i in range(n):
            log_sum += e[0, ch, i] ** 2
    return -0.5 * log_sum
