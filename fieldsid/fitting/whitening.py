"""Whiten free-run residuals: the Kalman filter of the motion that disturbances and coloured sensor noise cause.

The residual of a free run obeys, to first order, the linear base model without input:
    y' = p,  p' = -a p - k y + w,  w an AR(1) moment,  measured: y + n_y + white, p + n_p + white
with n_y, n_p AR(1). Its innovations over their standard deviations are white, and the same filter applied to the
sensitivities gives generalised least squares: the prediction-error method (Ljung 1999, chapter 7) in free-run form.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

NOISE_FIELDS = (
    "angle", "rate", "disturbance", "disturbance_time", "coloured_angle", "coloured_rate", "coloured_time",
)  # fmt: skip
STATES = 5


@jit
def transition(a: float, k: float, h: float) -> tuple[float, float, float, float, float, float]:
    """Return the held-input transition of (y, p) over h: f_yy, f_yp, f_py, f_pp, and what w adds to y and to p."""
    pieces = int(np.ceil(max(abs(a), np.sqrt(abs(k)), 1e-9) * h / 0.25))
    pieces = max(1, pieces)
    s = h / pieces
    yy, yp, py, pp, wy, wp = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    for _ in range(pieces):
        y0, p0 = np.array([yy, yp, wy]), np.array([py, pp, wp])
        add_y, add_p = y0.copy(), p0.copy()
        for order in range(1, 9):
            next_y = add_p * (s / order)
            next_p = (-a * add_p - k * add_y) * (s / order)
            if order == 1:
                next_p[2] += s
            add_y, add_p = next_y, next_p
            y0 = y0 + add_y
            p0 = p0 + add_p
        yy, yp, wy = y0[0], y0[1], y0[2]
        py, pp, wp = p0[0], p0[1], p0[2]
    return yy, yp, py, pp, wy, wp


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

    noise is (7,) in the order of NOISE_FIELDS. Samples not measured give zero.
    """
    count, n = series.shape[0], steps.shape[0] + 1
    cov = np.zeros((5, 5))
    cov[2, 2] = noise[2] ** 2
    cov[3, 3] = noise[4] ** 2
    cov[4, 4] = noise[5] ** 2
    white = np.array([noise[0] ** 2, noise[1] ** 2])
    f = np.zeros((5, 5))
    fp = np.zeros((5, 5))
    gain = np.zeros((2, 5))
    last_gain = np.zeros((2, 5))
    spread = np.ones(2)
    state = np.zeros((count, 5))
    nxt = np.zeros(5)
    log_sum = 0.0
    last_h = -1.0
    settled = 0
    for i in range(n):
        full = angle_ok[i] and rate_ok[i]
        if settled < 4 or not full:
            settled = settled if full else 0
            for ch in range(2):
                ok = angle_ok[i] if ch == 0 else rate_ok[i]
                if not ok:
                    continue
                row = ch + 3
                var = cov[ch, ch] + cov[row, row] + cov[ch, row] + cov[row, ch] + white[ch]
                spread[ch] = np.sqrt(var)
                for l in range(5):
                    gain[ch, l] = (cov[l, ch] + cov[l, row]) / var
                for l in range(5):
                    nxt[l] = cov[ch, l] + cov[row, l]
                for l in range(5):
                    for q in range(5):
                        cov[l, q] -= gain[ch, l] * nxt[q]
        for ch in range(2):
            ok = angle_ok[i] if ch == 0 else rate_ok[i]
            for j in range(count):
                if ok:
                    e = series[j, ch, i] - state[j, ch] - state[j, ch + 3]
                    out[j, ch, i] = e / spread[ch]
                    for l in range(5):
                        state[j, l] += gain[ch, l] * e
                else:
                    out[j, ch, i] = 0.0
            if ok:
                log_sum += 2.0 * np.log(spread[ch])
        if i == n - 1:
            break
        h = steps[i]
        if abs(h - last_h) > 1e-7 * h:
            settled = 0
            last_h = h
            yy, yp, py, pp, wy, wp = transition(a, k, h)
            rho = np.exp(-h / noise[3])
            col = np.exp(-h / noise[6])
            f[:] = 0.0
            f[0, 0], f[0, 1], f[0, 2] = yy, yp, wy
            f[1, 0], f[1, 1], f[1, 2] = py, pp, wp
            f[2, 2] = rho
            f[3, 3] = col
            f[4, 4] = col
        if settled < 4:
            for l in range(5):
                for q in range(5):
                    total = 0.0
                    for z in range(3):
                        total += f[l, z] * cov[z, q]
                    if l > 2:
                        total = f[l, l] * cov[l, q]
                    fp[l, q] = total
            for l in range(5):
                for q in range(5):
                    total = 0.0
                    for z in range(3):
                        total += fp[l, z] * f[q, z]
                    if q > 2:
                        total = fp[l, q] * f[q, q]
                    cov[l, q] = total
            cov[2, 2] += noise[2] ** 2 * (1.0 - f[2, 2] ** 2)
            cov[3, 3] += noise[4] ** 2 * (1.0 - f[3, 3] ** 2)
            cov[4, 4] += noise[5] ** 2 * (1.0 - f[4, 4] ** 2)
            moved = 0.0
            for ch in range(2):
                for l in range(5):
                    moved = max(moved, abs(gain[ch, l] - last_gain[ch, l]) / (abs(gain[ch, l]) + 1e-6))
                    last_gain[ch, l] = gain[ch, l]
            settled = settled + 1 if moved < 1e-7 else 0
        for j in range(count):
            y, p, w = state[j, 0], state[j, 1], state[j, 2]
            state[j, 0] = f[0, 0] * y + f[0, 1] * p + f[0, 2] * w
            state[j, 1] = f[1, 0] * y + f[1, 1] * p + f[1, 2] * w
            state[j, 2] = f[2, 2] * w
            state[j, 3] *= f[3, 3]
            state[j, 4] *= f[4, 4]
    return log_sum


def noise_vector(noise: Noise) -> FloatArray:
    """Return a noise record as the vector the filter takes, (7,)."""
    return np.array([getattr(noise, name) for name in NOISE_FIELDS])


def is_white(noise: Noise) -> bool:
    """Whether a noise record holds white sensor noise only."""
    return noise.disturbance == 0.0 and noise.coloured_angle == 0.0 and noise.coloured_rate == 0.0


def whiten(record: Record, noise: Noise, damping: float, stiffness: float, series: FloatArray) -> tuple[FloatArray, float]:
    """Return standardised innovations (m, 2, n) of series (m, 2, n) and the sum of the log variances.

    damping and stiffness are those of the linear base model at the run's speed; an unstable one is taken as
    marginal, since a residual does not grow where nonlinear damping holds the vehicle.
    """
    if is_white(noise):
        ok = np.stack([record.angle_ok, record.rate_ok])
        sigma = np.array([noise.angle, noise.rate])
        log_sum = 2.0 * float(ok.sum(axis=1) @ np.log(sigma))
        return np.where(ok, series / sigma[:, None], 0.0), log_sum
    out = np.empty_like(series)
    log_sum = innovations(
        record.steps, record.angle_ok, record.rate_ok, max(damping, 1e-3), max(stiffness, 0.0), noise_vector(noise), series, out
    )
    return out, float(log_sum)
