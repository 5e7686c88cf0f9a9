"""Tail probabilities and quantiles by the special functions: the library's own distributions take half a second to load."""

from __future__ import annotations

import numpy as np
from scipy.special import fdtrc, gammainc, gammaincc, ndtr, ndtri, stdtr, stdtrit

NORMAL_SKEWNESS = 1e-4
"""Skewness below which a distribution counts as normal."""


def chi_square_tail(statistic: float, freedom: float) -> float:
    """Return P(chi-square > statistic)."""
    return float(gammaincc(0.5 * freedom, 0.5 * statistic))


def f_tail(statistic: float, upper: float, lower: float) -> float:
    """Return P(F > statistic), of `upper` and `lower` degrees of freedom."""
    return float(fdtrc(upper, lower, statistic))


def student_tail(statistic: float, freedom: float) -> float:
    """Return P(t > statistic)."""
    return float(stdtr(freedom, -statistic))


def student_quantile(p: float, freedom: float) -> float:
    """Return the p-quantile of Student's t; that of the normal distribution where there are no degrees of freedom."""
    return float(stdtrit(freedom, p)) if freedom > 0 else float(ndtri(p))


def pearson3_tail(statistic: float, skewness: float) -> float:
    """Return P(x > statistic) of a shifted gamma distribution of zero mean, unit variance and a skewness."""
    if abs(skewness) < NORMAL_SKEWNESS:
        return float(ndtr(-statistic))
    root = 2.0 / skewness
    shape, scaled = root**2, root * statistic + root**2
    return float((gammaincc if skewness > 0.0 else gammainc)(shape, np.maximum(scaled, 0.0)))
