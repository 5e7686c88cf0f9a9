"""The compiled Kalman filter where a disturbance and white sensors are all there is: state (y, p, w)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.noise.kalman.transition import STEADY_GAIN_STEPS, gains_repeat, hold_gains, steady_until, transition
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit


@inner
def _learnt(
    own: float, cross: float, own_w: float, other: float, other_w: float, w: float, white: float
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Return a sample's variance, its gains, and what it leaves of the covariance of (y, p, w), in the order given.

    The sample is of y or of p, which is its own state; the gains are those of its own state, of the other and of w.
    """
    var = own + white
    share = 1.0 / var
    of_own, of_other, of_w = own * share, cross * share, own_w * share
    other, other_w, w = other - of_other * cross, other_w - of_other * own_w, w - of_w * own_w
    return (
        var, of_own, of_other, of_w,
        own - of_own * own, cross - of_own * cross, own_w - of_own * own_w, other, other_w, w,
    )  # fmt: skip


@inner
def _settled(
    series: FloatArray, out: FloatArray, first: int, stop: int, state: FloatArray, m: FloatArray,
    push: float, of_angle: float, of_rate: float,
) -> None:  # fmt: skip
    """Filter every series (m, 2, n) over samples first..stop - 1 with constant gains: one short chain of sums for each sample.

    m (3, 5) maps (y, p, w) and both samples to the next state; push is the gain of the rate by the angle; state is (m, 3).
    """
    yy, yp, yw, ya, yr = m[0, 0], m[0, 1], m[0, 2], m[0, 3], m[0, 4]
    py, pp, pw, pa, pr = m[1, 0], m[1, 1], m[1, 2], m[1, 3], m[1, 4]
    wy, wp, ww, wa, wr = m[2, 0], m[2, 1], m[2, 2], m[2, 3], m[2, 4]
    for j in range(series.shape[0]):
        y, p, w = state[j, 0], state[j, 1], state[j, 2]
        for i in range(first, stop):
            angle, rate = series[j, 0, i], series[j, 1, i]
            e = angle - y
            out[j, 0, i] = e * of_angle
            out[j, 1, i] = (rate - p - push * e) * of_rate
            y, p, w = (
                (yy * y + yp * p) + (yw * w + (ya * angle + yr * rate)),
                (py * y + pp * p) + (pw * w + (pa * angle + pr * rate)),
                (wy * y + wp * p) + (ww * w + (wa * angle + wr * rate)),
            )
        state[j, 0], state[j, 1], state[j, 2] = y, p, w


@jit
def disturbance_filter(
    steps: FloatArray, ok: npt.NDArray[np.bool_], a: float, k: float, noise: FloatArray,
    series: FloatArray, out: FloatArray, spreads: FloatArray,
) -> float:  # fmt: skip
    """Do what `innovations.kalman_filter` does, written out for the symmetric covariance; without a disturbance too."""
    n, log_sum, settled, i, last_h = steps.shape[0] + 1, 0.0, 0, 0, -1.0
    state, m = np.zeros((series.shape[0], 3)), np.empty((3, 5))
    c00, c01, c02, c11, c12, c22 = 0.0, 0.0, 0.0, 0.0, 0.0, noise[2] ** 2
    a0, a1, a2, b0, b1, b2, of_angle, of_rate = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0
    yy, yp, py, pp, yw, pw, ww = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0
    while i < n:
        if settled >= STEADY_GAIN_STEPS:
            stop, settled = steady_until(steps, ok, i, last_h), 0
            for c in range(5):
                y, p, w = 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2)
                e = 1.0 * (c == 3) - y
                y, p, w = y + a0 * e, p + a1 * e, w + a2 * e
                e = 1.0 * (c == 4) - p
                y, p, w = y + b0 * e, p + b1 * e, w + b2 * e
                m[0, c], m[1, c], m[2, c] = yy * y + yp * p + yw * w, py * y + pp * p + pw * w, ww * w
            _settled(series, out, i, stop, state, m, a1, 1.0 / of_angle, 1.0 / of_rate)
            log_sum += hold_gains(spreads[0], i, stop, of_angle) + hold_gains(spreads[1], i, stop, of_rate)
            i = stop
            continue
        seen, felt = ok[0, i], ok[1, i]
        still = seen and felt
        spreads[0, i] = spreads[1, i] = product = 1.0
        if seen:
            var, g0, g1, g2, c00, c01, c02, c11, c12, c22 = _learnt(c00, c01, c02, c11, c12, c22, noise[0] ** 2)
            still = still and gains_repeat(g0, a0) and gains_repeat(g1, a1) and gains_repeat(g2, a2)
            a0, a1, a2 = g0, g1, g2
            spreads[0, i] = of_angle = np.sqrt(var)
            product *= var
        if felt:
            var, g1, g0, g2, c11, c01, c12, c00, c02, c22 = _learnt(c11, c01, c12, c00, c02, c22, noise[1] ** 2)
            still = still and gains_repeat(g0, b0) and gains_repeat(g1, b1) and gains_repeat(g2, b2)
            b0, b1, b2 = g0, g1, g2
            spreads[1, i] = of_rate = np.sqrt(var)
            product *= var
        log_sum += np.log(product)
        if i < n - 1:
            h = steps[i]
            if abs(h - last_h) > 1e-7 * h:
                still, last_h = False, h
                yy, yp, py, pp, yw, pw = transition(a, k, h)
                ww = np.exp(-h / noise[3])
            u0, u1, u2 = yy * c00 + yp * c01 + yw * c02, yy * c01 + yp * c11 + yw * c12, yy * c02 + yp * c12 + yw * c22
            v0, v1, v2 = py * c00 + pp * c01 + pw * c02, py * c01 + pp * c11 + pw * c12, py * c02 + pp * c12 + pw * c22
            c00, c01, c02 = u0 * yy + u1 * yp + u2 * yw, u0 * py + u1 * pp + u2 * pw, u2 * ww
            c11, c12, c22 = v0 * py + v1 * pp + v2 * pw, v2 * ww, c22 * ww * ww + noise[2] ** 2 * (1.0 - ww * ww)
            settled = settled + 1 if still else 0
        for j in range(series.shape[0]):
            y, p, w = state[j, 0], state[j, 1], state[j, 2]
            out[j, 0, i] = out[j, 1, i] = 0.0
            if seen:
                e = series[j, 0, i] - y
                out[j, 0, i] = e / of_angle
                y, p, w = y + a0 * e, p + a1 * e, w + a2 * e
            if felt:
                e = series[j, 1, i] - p
                out[j, 1, i] = e / of_rate
                y, p, w = y + b0 * e, p + b1 * e, w + b2 * e
            state[j, 0], state[j, 1], state[j, 2] = yy * y + yp * p + yw * w, py * y + pp * p + pw * w, ww * w
        i += 1
    return log_sum
