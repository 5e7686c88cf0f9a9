"""The confidence interval of a share of a count."""

from __future__ import annotations

from scipy.stats import beta


def interval(hits, total, level=0.95):
    """Return the interval of a share by Clopper and Pearson (1934), Biometrika 26(4), which is exact for a binomial count."""
    rest = 0.5 * (1.0 - level)
    low = beta.ppf(rest, hits, total - hits + 1) if hits else 0.0
    return float(low), float(beta.ppf(1.0 - rest, hits + 1, total - hits) if hits < total else 1.0)
