"""The compiled Kalman filter of the motion that disturbances and coloured sensor noise cause.

State (y, p, w, n_y, n_p), see fitting/whitening.py; a noise is a vector (7,) in the order of whitening.NOISE_FIELDS.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit

SETTLED = 4


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
def _stays(gain: float, last: float) -> bool:
    """Whether a gain is what it was at the sample before."""
    return abs(gain - last) < 1e-7 * (abs(gain) + 1e-6)


@jit
def _all_stay(gain: FloatArray, last: FloatArray, low: int, high: int) -> bool:
    """Whether the gains (2, 5) are what `last` says, which becomes them."""
    still = True
    for ch in range(2):
        for l in range(low, high):
            still = still and _stays(gain[ch, l], last[ch, l])
            last[ch, l] = gain[ch, l]
    return still


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
def _learnt(
    own: float, cross: float, own_w: float, other: float, other_w: float, w: float, white: float
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Return a sample's variance, its gains, and what it leaves of the covariance of (y, p, w), in the order given.

    The sample is of y or of p, which is its own state; the gains are those of its own state, of the other and of w.
    """
    var = own + white
    of_own, of_other, of_w = own / var, cross / var, own_w / var
    other, other_w, w = other - of_other * cross, other_w - of_other * own_w, w - of_w * own_w
    return (
        var, of_own, of_other, of_w,
        own - of_own * own, cross - of_own * cross, own_w - of_own * own_w, other, other_w, w,
    )  # fmt: skip


@jit
def _waking(
    steps: FloatArray, ok: npt.NDArray[np.bool_], first: int, last_h: float,
    a: float, k: float, noise: FloatArray, series: FloatArray, out: FloatArray, spreads: FloatArray,
    cov: FloatArray, f: FloatArray, gain: FloatArray, spread: FloatArray, state: FloatArray,
) -> tuple[int, float, float]:  # fmt: skip
    """Filter from sample `first` until the gains have settled, where a disturbance and white sensors are all there is.

    The same as the general way, written out for the symmetric covariance of (y, p, w): most of a filter's time is spent
    here. Returns the sample it stops before, the sum of log variances, and the step f is of.
    """
    n, log_sum, settled, i = steps.shape[0] + 1, 0.0, 0, first
    c00, c01, c02, c11, c12, c22 = cov[0, 0], cov[0, 1], cov[0, 2], cov[1, 1], cov[1, 2], cov[2, 2]
    a0, a1, a2, b0, b1, b2 = gain[0, 0], gain[0, 1], gain[0, 2], gain[1, 0], gain[1, 1], gain[1, 2]
    while i < n and settled < SETTLED:
        still = ok[0, i] and ok[1, i]
        spreads[0, i] = spreads[1, i] = 1.0
        if ok[0, i]:
            var, g0, g1, g2, c00, c01, c02, c11, c12, c22 = _learnt(c00, c01, c02, c11, c12, c22, noise[0] ** 2)
            still = still and _stays(g0, a0) and _stays(g1, a1) and _stays(g2, a2)
            a0, a1, a2 = g0, g1, g2
            spreads[0, i] = spread[0] = np.sqrt(var)
            log_sum += np.log(var)
        if ok[1, i]:
            var, g1, g0, g2, c11, c01, c12, c00, c02, c22 = _learnt(c11, c01, c12, c00, c02, c22, noise[1] ** 2)
            still = still and _stays(g0, b0) and _stays(g1, b1) and _stays(g2, b2)
            b0, b1, b2 = g0, g1, g2
            spreads[1, i] = spread[1] = np.sqrt(var)
            log_sum += np.log(var)
        for j in range(series.shape[0]):
            y, p, w = state[j, 0], state[j, 1], state[j, 2]
            out[j, 0, i] = out[j, 1, i] = 0.0
            if ok[0, i]:
                e = series[j, 0, i] - y
                out[j, 0, i] = e / spread[0]
                y, p, w = y + a0 * e, p + a1 * e, w + a2 * e
            if ok[1, i]:
                e = series[j, 1, i] - p
                out[j, 1, i] = e / spread[1]
                y, p, w = y + b0 * e, p + b1 * e, w + b2 * e
            state[j, 0], state[j, 1], state[j, 2] = y, p, w
        if i < n - 1:
            h = steps[i]
            if abs(h - last_h) > 1e-7 * h:
                still, last_h = False, h
                _set_transition(a, k, h, noise, f)
            yy, yp, yw, py, pp, pw, ww = f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2]
            u0, u1, u2 = yy * c00 + yp * c01 + yw * c02, yy * c01 + yp * c11 + yw * c12, yy * c02 + yp * c12 + yw * c22
            v0, v1, v2 = py * c00 + pp * c01 + pw * c02, py * c01 + pp * c11 + pw * c12, py * c02 + pp * c12 + pw * c22
            c00, c01, c02 = u0 * yy + u1 * yp + u2 * yw, u0 * py + u1 * pp + u2 * pw, u2 * ww
            c11, c12, c22 = v0 * py + v1 * pp + v2 * pw, v2 * ww, c22 * ww * ww + noise[2] ** 2 * (1.0 - ww * ww)
            _carry(f, state)
            settled = settled + 1 if still else 0
        i += 1
    cov[0, 0], cov[0, 1], cov[0, 2], cov[1, 1], cov[1, 2], cov[2, 2] = c00, c01, c02, c11, c12, c22
    gain[0, 0], gain[0, 1], gain[0, 2], gain[1, 0], gain[1, 1], gain[1, 2] = a0, a1, a2, b0, b1, b2
    return i, log_sum, last_h


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
    cov, f, fp = np.zeros((5, 5)), np.zeros((5, 5)), np.zeros((5, 5))
    gain, last_gain, spread, row = np.zeros((2, 5)), np.zeros((2, 5)), np.empty(2), np.zeros(5)
    state = np.zeros((series.shape[0], 5))
    cov[2, 2], cov[3, 3], cov[4, 4] = noise[2] ** 2, noise[4] ** 2, noise[5] ** 2
    low, high = _moving(noise)
    log_sum, last_h, settled = 0.0, -1.0, 0
    i = min(0, n)  # no literal: everything called with one is compiled once more
    while i < n:
        if settled >= SETTLED:
            stop = _settled_until(steps, ok, i, last_h)
            _settled(series, out, i, stop, gain, f, spread, state, low, high)
            for ch in range(2):
                for l in range(i, stop):
                    spreads[ch, l] = spread[ch]
                log_sum += 2.0 * (stop - i) * np.log(spread[ch])
            i, settled = stop, 0
            continue
        if low == 0 and high < 5:
            i, logs, last_h = _waking(
                steps, ok, i, last_h, a, k, noise, series, out, spreads, cov, f, gain, spread, state
            )  # fmt: skip
            log_sum, settled = log_sum + logs, SETTLED
            continue
        for ch in range(2):
            spreads[ch, i] = 1.0
            for j in range(series.shape[0]):
                out[j, ch, i] = 0.0
            if ok[ch, i]:
                spreads[ch, i] = spread[ch] = _correct(cov, ch, noise[ch] ** 2, gain, row, low, high)
                log_sum += 2.0 * np.log(spread[ch])
                _take(series, out, i, ch, gain, spread[ch], state)
        if i < n - 1:
            h = steps[i]
            if abs(h - last_h) > 1e-7 * h:
                settled, last_h = 0, h
                _set_transition(a, k, h, noise, f)
            _advance(cov, f, fp, noise, low, high)
            settled = settled + 1 if ok[0, i] and ok[1, i] and _all_stay(gain, last_gain, low, high) else 0
            _carry(f, state)
        i += 1
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
