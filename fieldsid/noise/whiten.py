"""Whiten free-run residuals: the Kalman filter of the motion that disturbances and coloured sensor noise cause.

The residual of a free run obeys, to first order, the linear base model without input:
    y' = p,  p' = -a p - k y + w,  w an AR(1) moment,  measured: y + n_y + white, p + n_p + white
with n_y, n_p AR(1). Its innovations over their standard deviations are white, and the same filter applied to the
sensitivities gives generalised least squares: the prediction-error method (Ljung 1999, chapter 7) in free-run form.
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.innovations import innovations
from fieldsid.noise.noise_kinds import NOISE_FIELDS
from fieldsid.numerics.arrays import FloatArray


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
        weight = np.array([1.0 / noise.angle, 1.0 / noise.rate])
        log_sum = -2.0 * float(record.ok.sum(axis=1) @ np.log(weight))
        white = series * weight[:, None]
        return white if record.is_whole else np.where(record.ok, white, 0.0), log_sum
    out = np.empty_like(series)
    log_sum = innovations(
        record.nominal_steps, record.ok, max(damping, 1e-3), max(stiffness, 0.0), noise_vector(noise), series, out
    )
    return out, float(log_sum)
