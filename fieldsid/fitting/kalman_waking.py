"""The Kalman filter while its gains have not settled, written out state by state: most of a filter's time is spent here."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.kalman_state import carry, set_transition, stays
from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit

SETTLED = 4
"""Steps in a row that leave the gains as they are, after which they are kept."""


@jit
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


@jit
def waking(
    steps: FloatArray, ok: npt.NDArray[np.bool_], first: int, last_h: float,
    a: float, k: float, noise: FloatArray, series: FloatArray, out: FloatArray, spreads: FloatArray,
    cov: FloatArray, f: FloatArray, gain: FloatArray, spread: FloatArray, state: FloatArray,
) -> tuple[int, float, float]:  # fmt: skip
    """Filter from sample `first` until the gains have settled, where a disturbance and white sensors are all there is.

    Written out for the symmetric covariance of (y, p, w). Returns the sample it stops before, the sum of log variances, and
    the step f is of.
    """
    n, log_sum, settled, i = steps.shape[0] + 1, 0.0, 0, first
    c00, c01, c02, c11, c12, c22 = cov[0, 0], cov[0, 1], cov[0, 2], cov[1, 1], cov[1, 2], cov[2, 2]
    a0, a1, a2, b0, b1, b2 = gain[0, 0], gain[0, 1], gain[0, 2], gain[1, 0], gain[1, 1], gain[1, 2]
    while i < n and settled < SETTLED:
        still = ok[0, i] and ok[1, i]
        spreads[0, i] = spreads[1, i] = product = 1.0
        if ok[0, i]:
            var, g0, g1, g2, c00, c01, c02, c11, c12, c22 = _learnt(c00, c01, c02, c11, c12, c22, noise[0] ** 2)
            still = still and stays(g0, a0) and stays(g1, a1) and stays(g2, a2)
            a0, a1, a2 = g0, g1, g2
            spreads[0, i] = spread[0] = np.sqrt(var)
            product *= var
        if ok[1, i]:
            var, g1, g0, g2, c11, c01, c12, c00, c02, c22 = _learnt(c11, c01, c12, c00, c02, c22, noise[1] ** 2)
            still = still and stays(g0, b0) and stays(g1, b1) and stays(g2, b2)
            b0, b1, b2 = g0, g1, g2
            spreads[1, i] = spread[1] = np.sqrt(var)
            product *= var
        log_sum += np.log(product)
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
                set_transition(a, k, h, noise, f)
            yy, yp, yw, py, pp, pw, ww = f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2]
            u0, u1, u2 = yy * c00 + yp * c01 + yw * c02, yy * c01 + yp * c11 + yw * c12, yy * c02 + yp * c12 + yw * c22
            v0, v1, v2 = py * c00 + pp * c01 + pw * c02, py * c01 + pp * c11 + pw * c12, py * c02 + pp * c12 + pw * c22
            c00, c01, c02 = u0 * yy + u1 * yp + u2 * yw, u0 * py + u1 * pp + u2 * pw, u2 * ww
            c11, c12, c22 = v0 * py + v1 * pp + v2 * pw, v2 * ww, c22 * ww * ww + noise[2] ** 2 * (1.0 - ww * ww)
            carry(f, state)
            settled = settled + 1 if still else 0
        i += 1
    cov[0, 0], cov[0, 1], cov[0, 2], cov[1, 1], cov[1, 2], cov[2, 2] = c00, c01, c02, c11, c12, c22
    gain[0, 0], gain[0, 1], gain[0, 2], gain[1, 0], gain[1, 1], gain[1, 2] = a0, a1, a2, b0, b1, b2
    return i, log_sum, last_h


@jit
def waking_of_sensors(
    steps: FloatArray, ok: npt.NDArray[np.bool_], first: int, last_h: float,
    a: float, k: float, noise: FloatArray, series: FloatArray, out: FloatArray, spreads: FloatArray,
    cov: FloatArray, f: FloatArray, gain: FloatArray, spread: FloatArray, state: FloatArray,
) -> tuple[int, float, float]:  # fmt: skip
    """Do what `waking` does where the sensors alone are noisy: each then has nothing to do with the other."""
    n, log_sum, settled, i = steps.shape[0] + 1, 0.0, 0, first
    while i < n and settled < SETTLED:
        still = ok[0, i] and ok[1, i]
        for ch in range(2):
            own, white = cov[ch + 3, ch + 3], noise[ch] ** 2
            spreads[ch, i] = 1.0
            if ok[ch, i]:
                g = own / (own + white)
                still = still and stays(g, gain[ch, ch + 3])
                cov[ch + 3, ch + 3], gain[ch, ch + 3] = own - g * own, g
                spreads[ch, i] = spread[ch] = np.sqrt(own + white)
                log_sum += np.log(own + white)
            for j in range(series.shape[0]):
                out[j, ch, i] = 0.0
                if ok[ch, i]:
                    e = series[j, ch, i] - state[j, ch + 3]
                    out[j, ch, i] = e / spread[ch]
                    state[j, ch + 3] += gain[ch, ch + 3] * e
        if i < n - 1:
            h = steps[i]
            if abs(h - last_h) > 1e-7 * h:
                still, last_h = False, h
                set_transition(a, k, h, noise, f)
            kept = f[3, 3] ** 2
            cov[3, 3] = cov[3, 3] * kept + noise[4] ** 2 * (1.0 - kept)
            cov[4, 4] = cov[4, 4] * kept + noise[5] ** 2 * (1.0 - kept)
            carry(f, state)
            settled = settled + 1 if still else 0
        i += 1
    return i, log_sum, last_h


@jit
def _less(
    r0: float, r1: float, r2: float, r3: float, r4: float, var: float,
    c00: float, c01: float, c02: float, c03: float, c04: float, c11: float, c12: float, c13: float, c14: float,
    c22: float, c23: float, c24: float, c33: float, c34: float, c44: float,
) -> tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float,
    float, float,
]:  # fmt: skip
    """Return the gains of a sample of variance var and covariances r with the state, and the state's covariance after it."""
    share = 1.0 / var
    g0, g1, g2, g3, g4 = r0 * share, r1 * share, r2 * share, r3 * share, r4 * share
    return (
        g0, g1, g2, g3, g4,
        c00 - g0 * r0, c01 - g0 * r1, c02 - g0 * r2, c03 - g0 * r3, c04 - g0 * r4,
        c11 - g1 * r1, c12 - g1 * r2, c13 - g1 * r3, c14 - g1 * r4,
        c22 - g2 * r2, c23 - g2 * r3, c24 - g2 * r4, c33 - g3 * r3, c34 - g3 * r4, c44 - g4 * r4,
    )  # fmt: skip


@jit
def waking_of_both(
    steps: FloatArray, ok: npt.NDArray[np.bool_], first: int, last_h: float,
    a: float, k: float, noise: FloatArray, series: FloatArray, out: FloatArray, spreads: FloatArray,
    cov: FloatArray, f: FloatArray, gain: FloatArray, spread: FloatArray, state: FloatArray,
) -> tuple[int, float, float]:  # fmt: skip
    """Do what `waking` does where sensors wander besides: written out for the symmetric covariance of all five states.

    A wander of half a minute lets the gains settle nowhere in a run, so that all of the filter's time is spent here.
    """
    n, log_sum, settled, i = steps.shape[0] + 1, 0.0, 0, first
    c00, c01, c02, c03, c04 = cov[0, 0], cov[0, 1], cov[0, 2], cov[0, 3], cov[0, 4]
    c11, c12, c13, c14, c22 = cov[1, 1], cov[1, 2], cov[1, 3], cov[1, 4], cov[2, 2]
    c23, c24, c33, c34, c44 = cov[2, 3], cov[2, 4], cov[3, 3], cov[3, 4], cov[4, 4]
    a0, a1, a2, a3, a4 = gain[0, 0], gain[0, 1], gain[0, 2], gain[0, 3], gain[0, 4]
    b0, b1, b2, b3, b4 = gain[1, 0], gain[1, 1], gain[1, 2], gain[1, 3], gain[1, 4]
    while i < n and settled < SETTLED:
        still = ok[0, i] and ok[1, i]
        spreads[0, i] = spreads[1, i] = product = 1.0
        if ok[0, i]:
            r0, r1, r2, r3, r4 = c00 + c03, c01 + c13, c02 + c23, c03 + c33, c04 + c34
            var = r0 + r3 + noise[0] ** 2
            g0, g1, g2, g3, g4, c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44 = _less(
                r0, r1, r2, r3, r4, var, c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44
            )
            still = still and stays(g0, a0) and stays(g1, a1) and stays(g2, a2) and stays(g3, a3) and stays(g4, a4)
            a0, a1, a2, a3, a4 = g0, g1, g2, g3, g4
            spreads[0, i] = spread[0] = np.sqrt(var)
            product *= var
        if ok[1, i]:
            r0, r1, r2, r3, r4 = c01 + c04, c11 + c14, c12 + c24, c13 + c34, c14 + c44
            var = r1 + r4 + noise[1] ** 2
            g0, g1, g2, g3, g4, c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44 = _less(
                r0, r1, r2, r3, r4, var, c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44
            )
            still = still and stays(g0, b0) and stays(g1, b1) and stays(g2, b2) and stays(g3, b3) and stays(g4, b4)
            b0, b1, b2, b3, b4 = g0, g1, g2, g3, g4
            spreads[1, i] = spread[1] = np.sqrt(var)
            product *= var
        log_sum += np.log(product)
        for j in range(series.shape[0]):
            y, p, w, m, q = state[j, 0], state[j, 1], state[j, 2], state[j, 3], state[j, 4]
            out[j, 0, i] = out[j, 1, i] = 0.0
            if ok[0, i]:
                e = series[j, 0, i] - y - m
                out[j, 0, i] = e / spread[0]
                y, p, w, m, q = y + a0 * e, p + a1 * e, w + a2 * e, m + a3 * e, q + a4 * e
            if ok[1, i]:
                e = series[j, 1, i] - p - q
                out[j, 1, i] = e / spread[1]
                y, p, w, m, q = y + b0 * e, p + b1 * e, w + b2 * e, m + b3 * e, q + b4 * e
            state[j, 0], state[j, 1], state[j, 2], state[j, 3], state[j, 4] = y, p, w, m, q
        if i < n - 1:
            h = steps[i]
            if abs(h - last_h) > 1e-7 * h:
                still, last_h = False, h
                set_transition(a, k, h, noise, f)
            yy, yp, yw, py, pp, pw = f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2]
            ww, mm = f[2, 2], f[3, 3]
            u0, u1, u2 = yy * c00 + yp * c01 + yw * c02, yy * c01 + yp * c11 + yw * c12, yy * c02 + yp * c12 + yw * c22
            v0, v1, v2 = py * c00 + pp * c01 + pw * c02, py * c01 + pp * c11 + pw * c12, py * c02 + pp * c12 + pw * c22
            c03, c13 = (yy * c03 + yp * c13 + yw * c23) * mm, (py * c03 + pp * c13 + pw * c23) * mm
            c04, c14 = (yy * c04 + yp * c14 + yw * c24) * mm, (py * c04 + pp * c14 + pw * c24) * mm
            c00, c01, c02 = u0 * yy + u1 * yp + u2 * yw, u0 * py + u1 * pp + u2 * pw, u2 * ww
            c11, c12, c22 = v0 * py + v1 * pp + v2 * pw, v2 * ww, c22 * ww * ww + noise[2] ** 2 * (1.0 - ww * ww)
            c23, c24, c34 = c23 * ww * mm, c24 * ww * mm, c34 * mm * mm
            c33 = c33 * mm * mm + noise[4] ** 2 * (1.0 - mm * mm)
            c44 = c44 * mm * mm + noise[5] ** 2 * (1.0 - mm * mm)
            carry(f, state)
            settled = settled + 1 if still else 0
        i += 1
    cov[0, 0], cov[0, 1], cov[0, 2], cov[0, 3], cov[0, 4] = c00, c01, c02, c03, c04
    cov[1, 1], cov[1, 2], cov[1, 3], cov[1, 4], cov[2, 2] = c11, c12, c13, c14, c22
    cov[2, 3], cov[2, 4], cov[3, 3], cov[3, 4], cov[4, 4] = c23, c24, c33, c34, c44
    gain[0, 0], gain[0, 1], gain[0, 2], gain[0, 3], gain[0, 4] = a0, a1, a2, a3, a4
    gain[1, 0], gain[1, 1], gain[1, 2], gain[1, 3], gain[1, 4] = b0, b1, b2, b3, b4
    return i, log_sum, last_h
