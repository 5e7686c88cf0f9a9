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
def _correct(cov: FloatArray, channel: int, white: float, gain: FloatArray, row: FloatArray) -> float:
    """Take one channel's measurement into cov (5, 5); fill its gain (2, 5); return its innovation's spread."""
    other = channel + 3
    for l in range(5):
        row[l] = cov[channel, l] + cov[other, l]
    var = row[channel] + row[other] + white
    for l in range(5):
        gain[channel, l] = row[l] / var
    for l in range(5):
        for q in range(5):
            cov[l, q] -= gain[channel, l] * row[q]
    return float(np.sqrt(var))


@jit
def _advance(cov: FloatArray, f: FloatArray, fp: FloatArray, noise: FloatArray) -> None:
    """Carry cov (5, 5) over one interval in place; fp (5, 5) is room to work in. Only f[:2, :3] is not diagonal."""
    for l in range(5):
        for q in range(5):
            if l < 2:
                fp[l, q] = f[l, 0] * cov[0, q] + f[l, 1] * cov[1, q] + f[l, 2] * cov[2, q]
            else:
                fp[l, q] = f[l, l] * cov[l, q]
    for l in range(5):
        for q in range(5):
            if q < 2:
                cov[l, q] = fp[l, 0] * f[q, 0] + fp[l, 1] * f[q, 1] + fp[l, 2] * f[q, 2]
            else:
                cov[l, q] = fp[l, q] * f[q, q]
    cov[2, 2] += noise[2] ** 2 * (1.0 - f[2, 2] ** 2)
    cov[3, 3] += noise[4] ** 2 * (1.0 - f[3, 3] ** 2)
    cov[4, 4] += noise[5] ** 2 * (1.0 - f[4, 4] ** 2)


@jit
def _moved(gain: FloatArray, last: FloatArray) -> float:
    """Return the largest relative change of the gains (2, 5) since `last`, which becomes them."""
    moved = 0.0
    for ch in range(2):
        for l in range(5):
            moved = max(moved, abs(gain[ch, l] - last[ch, l]) / (abs(gain[ch, l]) + 1e-6))
            last[ch, l] = gain[ch, l]
    return moved


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

    noise is (7,) in the order of NOISE_FIELDS. Samples not measured give zero. Once four steps in a row of equal
    length leave the gains as they are, they are kept until a sample is missing or the step changes.
    """
    count, n = series.shape[0], steps.shape[0] + 1
    cov, f, fp = np.zeros((5, 5)), np.zeros((5, 5)), np.zeros((5, 5))
    gain, last_gain, spread, row = np.zeros((2, 5)), np.zeros((2, 5)), np.ones(2), np.zeros(5)
    state = np.zeros((count, 5))
    cov[2, 2], cov[3, 3], cov[4, 4] = noise[2] ** 2, noise[4] ** 2, noise[5] ** 2
    log_sum, last_h, settled = 0.0, -1.0, 0
    for i in range(n):
        full = angle_ok[i] and rate_ok[i]
        settled = settled if full else 0
        for ch in range(2):
            if not (angle_ok[i] if ch == 0 else rate_ok[i]):
                for j in range(count):
                    out[j, ch, i] = 0.0
                continue
            if settled < 4:
                spread[ch] = _correct(cov, ch, noise[ch] ** 2, gain, row)
            log_sum += 2.0 * np.log(spread[ch])
            for j in range(count):
                e = series[j, ch, i] - state[j, ch] - state[j, ch + 3]
                out[j, ch, i] = e / spread[ch]
                for l in range(5):
                    state[j, l] += gain[ch, l] * e
        if i == n - 1:
            break
        h = steps[i]
        if abs(h - last_h) > 1e-7 * h:
            settled, last_h = 0, h
            _set_transition(a, k, h, noise, f)
        if settled < 4:
            _advance(cov, f, fp, noise)
            settled = settled + 1 if _moved(gain, last_gain) < 1e-7 else 0
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
