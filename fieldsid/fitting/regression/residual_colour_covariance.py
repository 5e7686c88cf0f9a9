"""Covariance of a linear least-squares estimate whose residuals are not white.

Cov = (F'F)^-1 (F' S F) (F'F)^-1 with the residual e = H(q) n, A(q) n = w of variance s^2, H known and A estimated:
then F' S F = s^2 G'G with G the columns run backwards through H/A. The order of A is chosen by Schwarz's criterion.
Source: Ljung 1999, section 9.5 (covariance without a noise model); Morelli and Klein 1997, J. Guidance 20(3),
Accuracy of aerodynamic model parameters estimated from flight test data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.regression.noise_transfer import Transfer, inverse_of
from fieldsid.numerics.arrays import FloatArray

MAX_AR_ORDER = 30


@dataclass(frozen=True, slots=True)
class ResidualColour:
    """An autoregression: denominator (order + 1,) with a leading 1, variance of its white input, variance of the series."""

    denominator: FloatArray
    input_variance: float
    variance: float

    @property
    def long_run(self) -> float:
        """Spectrum at zero frequency over the variance: samples for each independent one; 1 where white."""
        if self.variance == 0.0:
            return 1.0
        return float(self.input_variance / self.denominator.sum() ** 2 / self.variance)


def colour_of(parts: Sequence[FloatArray]) -> ResidualColour:
    """Return the autoregression of residual series [(n,)], pooled, by Levinson's recursion."""
    count = sum(p.size for p in parts)
    highest = max(1, min(MAX_AR_ORDER, min(p.size for p in parts) // 10, count // 20))
    power = np.array([sum(float(p[lag:] @ p[: p.size - lag]) for p in parts) / count for lag in range(highest + 1)])
    return autoregression(power, count)


def autoregression(power: FloatArray, count: float, price: float | None = None) -> ResidualColour:
    """Return the autoregression of a series of `count` samples with autocovariances (order + 1,), by Levinson's recursion.

    Its order is chosen by the fit and a penalty per coefficient: by default Schwarz's log(count); 2 is Akaike's.
    """
    price = float(np.log(count)) if price is None else price
    if power[0] <= 0.0:
        return ResidualColour(np.ones(1), 0.0, 0.0)
    best, least = ResidualColour(np.ones(1), float(power[0]), float(power[0])), count * float(np.log(power[0]))
    a, left = np.ones(1), float(power[0])
    for order in range(1, power.size):
        reflection = -float(a @ power[order:0:-1][: a.size]) / left
        longer = np.append(a, 0.0)
        a = longer + reflection * longer[::-1]
        left *= max(1.0 - reflection * reflection, 1e-12)
        score = count * float(np.log(left)) + order * price
        if score < least:
            best, least = ResidualColour(a, left, float(power[0])), score
    return best


@dataclass(frozen=True, slots=True)
class Series:
    """One run's regression rows: columns (n, p), residual (n,), and the transfer from sample noise to the residual."""

    columns: FloatArray
    residual: FloatArray
    transfer: Transfer
    step: float


def noise_colour(series: Sequence[Series]) -> ResidualColour:
    """Return the autoregression of the samples' noise, which the residuals tell: white without a disturbance of the hull."""
    from scipy.signal import lfilter

    back = [inverse_of(s.transfer, s.step) for s in series]
    return colour_of([lfilter(b.numerator, b.denominator, s.residual) for b, s in zip(back, series, strict=True)])


def coloured_covariance(series: Sequence[Series], inverse: FloatArray) -> FloatArray:
    """Return the covariance (p, p) of an estimate with an inverse normal matrix (p, p), allowing for colour.

    Of instrumental variables the columns are the instruments Z, and the inverse is that of Phi' Z.
    The residual is first taken back to the samples' noise through the inverse transfer, where it is white or
    nearly so; an autoregression holds what colour is left.
    """
    from scipy.signal import lfilter

    count, size, colour = sum(s.residual.size for s in series), inverse.shape[0], noise_colour(series)
    total = np.zeros_like(inverse)
    for s in series:
        seen = lfilter(s.transfer.numerator, s.transfer.denominator, s.columns[::-1], axis=0)
        # as squares of rows: multiplied out as N^-1 (F' S F) N^-1, rounding may leave a variance below zero
        half = lfilter([1.0], colour.denominator, seen, axis=0) @ inverse
        total += colour.input_variance * half.T @ half
    independent = max(count / max(colour.long_run, 1e-3), 2.0 * size)
    return np.asarray(total * (independent / (independent - size)))
