"""The compiled Kalman filter for disturbance and coloured sensor noise together: state (y, p, w, n_y, n_p)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.noise.kalman.transition import STEADY_GAIN_STEPS, gains_repeat, hold_gains, steady_until, transition
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit


@inner
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
def full_filter(
    steps: FloatArray, ok: npt.NDArray[np.bool_], a: float, k: float, noise: FloatArray,
    series: FloatArray, out: FloatArray, spreads: FloatArray,
) -> float:  # fmt: skip
    """Do what `innovations.kalman_filter` does, written out for the symmetric covariance of all five states.

    Sensor noise correlated over half a minute keeps the gains from becoming constant within a run: all time is spent in the
    general part.
    """
    n, log_sum, settled, i, last_h = steps.shape[0] + 1, 0.0, 0, 0, -1.0
    state = np.zeros((series.shape[0], 5))
    c00, c01, c02, c03, c04, c11, c12, c13, c14, c22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, noise[2] ** 2
    c23, c24, c33, c34, c44 = 0.0, 0.0, noise[4] ** 2, 0.0, noise[5] ** 2
    a0, a1, a2, a3, a4, of_angle = 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
    b0, b1, b2, b3, b4, of_rate = 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
    yy, yp, py, pp, yw, pw, ww, mm = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0
    while i < n:
        if settled >= STEADY_GAIN_STEPS:
            stop, settled = steady_until(steps, ok, i, last_h), 0
            over_angle, over_rate = 1.0 / of_angle, 1.0 / of_rate
            for j in range(series.shape[0]):
                y, p, w, m, q = state[j, 0], state[j, 1], state[j, 2], state[j, 3], state[j, 4]
                for l in range(i, stop):
                    e = series[j, 0, l] - y - m
                    out[j, 0, l] = e * over_angle
                    y, p, w, m, q = y + a0 * e, p + a1 * e, w + a2 * e, m + a3 * e, q + a4 * e
                    e = series[j, 1, l] - p - q
                    out[j, 1, l] = e * over_rate
                    y, p, w, m, q = y + b0 * e, p + b1 * e, w + b2 * e, m + b3 * e, q + b4 * e
                    y, p, w, m, q = yy * y + yp * p + yw * w, py * y + pp * p + pw * w, ww * w, mm * m, mm * q
                state[j, 0], state[j, 1], state[j, 2], state[j, 3], state[j, 4] = y, p, w, m, q
            log_sum += hold_gains(spreads[0], i, stop, of_angle) + hold_gains(spreads[1], i, stop, of_rate)
            i = stop
            continue
        seen, felt = ok[0, i], ok[1, i]
        still = seen and felt
        spreads[0, i] = spreads[1, i] = product = 1.0
        if seen:
            r0, r1, r2, r3, r4 = c00 + c03, c01 + c13, c02 + c23, c03 + c33, c04 + c34
            var = r0 + r3 + noise[0] ** 2
            g0, g1, g2, g3, g4, c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44 = _less(
                r0, r1, r2, r3, r4, var, c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44
            )
            still = (
                still
                and gains_repeat(g0, a0)
                and gains_repeat(g1, a1)
                and gains_repeat(g2, a2)
                and gains_repeat(g3, a3)
                and gains_repeat(g4, a4)
            )
            a0, a1, a2, a3, a4 = g0, g1, g2, g3, g4
            spreads[0, i] = of_angle = np.sqrt(var)
            product *= var
        if felt:
            r0, r1, r2, r3, r4 = c01 + c04, c11 + c14, c12 + c24, c13 + c34, c14 + c44
            var = r1 + r4 + noise[1] ** 2
            g0, g1, g2, g3, g4, c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44 = _less(
                r0, r1, r2, r3, r4, var, c00, c01, c02, c03, c04, c11, c12, c13, c14, c22, c23, c24, c33, c34, c44
            )
            still = (
                still
                and gains_repeat(g0, b0)
                and gains_repeat(g1, b1)
                and gains_repeat(g2, b2)
                and gains_repeat(g3, b3)
                and gains_repeat(g4, b4)
            )
            b0, b1, b2, b3, b4 = g0, g1, g2, g3, g4
            spreads[1, i] = of_rate = np.sqrt(var)
            product *= var
        log_sum += np.log(product)
        if i < n - 1:
            h = steps[i]
            if abs(h - last_h) > 1e-7 * h:
                still, last_h = False, h
                yy, yp, py, pp, yw, pw = transition(a, k, h)
                ww, mm = np.exp(-h / noise[3]), np.exp(-h / noise[6])
            u0, u1, u2 = yy * c00 + yp * c01 + yw * c02, yy * c01 + yp * c11 + yw * c12, yy * c02 + yp * c12 + yw * c22
            v0, v1, v2 = py * c00 + pp * c01 + pw * c02, py * c01 + pp * c11 + pw * c12, py * c02 + pp * c12 + pw * c22
            c03, c13 = (yy * c03 + yp * c13 + yw * c23) * mm, (py * c03 + pp * c13 + pw * c23) * mm
            c04, c14 = (yy * c04 + yp * c14 + yw * c24) * mm, (py * c04 + pp * c14 + pw * c24) * mm
            c00, c01, c02 = u0 * yy + u1 * yp + u2 * yw, u0 * py + u1 * pp + u2 * pw, u2 * ww
            c11, c12, c22 = v0 * py + v1 * pp + v2 * pw, v2 * ww, c22 * ww * ww + noise[2] ** 2 * (1.0 - ww * ww)
            c23, c24, c34 = c23 * ww * mm, c24 * ww * mm, c34 * mm * mm
            c33 = c33 * mm * mm + noise[4] ** 2 * (1.0 - mm * mm)
            c44 = c44 * mm * mm + noise[5] ** 2 * (1.0 - mm * mm)
            settled = settled + 1 if still else 0
        for j in range(series.shape[0]):
            y, p, w, m, q = state[j, 0], state[j, 1], state[j, 2], state[j, 3], state[j, 4]
            out[j, 0, i] = out[j, 1, i] = 0.0
            if seen:
                e = series[j, 0, i] - y - m
                out[j, 0, i] = e / of_angle
                y, p, w, m, q = y + a0 * e, p + a1 * e, w + a2 * e, m + a3 * e, q + a4 * e
            if felt:
                e = series[j, 1, i] - p - q
                out[j, 1, i] = e / of_rate
                y, p, w, m, q = y + b0 * e, p + b1 * e, w + b2 * e, m + b3 * e, q + b4 * e
            state[j, 0], state[j, 1], state[j, 2] = yy * y + yp * p + yw * w, py * y + pp * p + pw * w, ww * w
            state[j, 3], state[j, 4] = mm * m, mm * q
        i += 1
    return log_sum
