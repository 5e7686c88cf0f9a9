"""Whiten free-run residuals: the Kalman filter of the motion that disturbances and coloured sensor noise cause.

The residual of a free run obeys, to first order, the linear base model without input:
    y' = p,  p' = -a p - k y + w,  w an AR(1) moment,  measured: y + n_y + white, p + n_p + white
with n_y, n_p AR(1). Its innovations over their standard deviations are white, and the same filter applied to the
sensitivities gives generalised least squares: the prediction-error method (Ljung 1999, chapter 7) in free-run form.
The random constant moment of a run is whitened afterwards (moment_response.py).
"""

from __future__ import annotations

from operator import attrgetter

import numpy as np

from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.innovations import innovations
from fieldsid.noise.moment_response import base_responses, without_common_moment
from fieldsid.noise.noise_kinds import NOISE_FIELDS
from fieldsid.numerics.arrays import FloatArray

_FIELDS = attrgetter(*NOISE_FIELDS)
MIN_DAMPING_1_S = 1e-3
"""Least damping in 1/s of the base model through which noise acts: nonlinear damping bounds the residual of an unstable one."""


def noise_vector(noise: Noise) -> FloatArray:
    """Return the stationary part of a noise record as the vector (7,) that the filter takes."""
    return np.array(_FIELDS(noise))


def is_white(noise: Noise) -> bool:
    """Whether a noise record consists of white sensor noise only."""
    return _is_stationary_white(noise) and noise.own_moment == 0.0


def _is_stationary_white(noise: Noise) -> bool:
    return noise.disturbance == 0.0 and noise.coloured_angle == 0.0 and noise.coloured_rate == 0.0


def base_dynamics(damping: float, stiffness: float) -> tuple[float, float]:
    """Return the damping and stiffness of the base model through which noise acts: an unstable one is taken as marginal."""
    return max(damping, MIN_DAMPING_1_S), max(stiffness, 0.0)


def whiten(record: Record, noise: Noise, damping: float, stiffness: float, series: FloatArray) -> tuple[FloatArray, float]:
    """Return standardised innovations (m, 2, n) of series (m, 2, n) and the sum of the log variances.

    damping and stiffness are those of the linear base model at the run's speed.
    """
    if noise.own_moment == 0.0:
        return _whiten_stationary(record, noise, damping, stiffness, series)
    response = base_responses(record.nominal_steps, *base_dynamics(damping, stiffness))[:1]
    out, log_sum = _whiten_stationary(record, noise, damping, stiffness, np.concatenate([series, response]))
    white, log_variance = without_common_moment(out[:-1], out[-1], noise.own_moment)
    return white, log_sum + log_variance


def _whiten_stationary(
    record: Record, noise: Noise, damping: float, stiffness: float, series: FloatArray
) -> tuple[FloatArray, float]:
    if _is_stationary_white(noise):
        weight = np.array([1.0 / noise.angle, 1.0 / noise.rate])
        log_sum = -2.0 * float(record.ok.sum(axis=1) @ np.log(weight))
        white = series * weight[:, None]
        return white if record.is_whole else np.where(record.ok, white, 0.0), log_sum
    out = np.empty_like(series)
    log_sum = innovations(record.nominal_steps, record.ok, *base_dynamics(damping, stiffness), noise_vector(noise), series, out)
    return out, float(log_sum)
