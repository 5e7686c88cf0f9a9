"""The figure of a fit's residuals: autocorrelation, and correlation with the fin, each with its 99 % band.

The autocorrelation of white residuals stays within 2.58/sqrt(n). A cross-correlation with the fin at positive lags shows that the
model lacks something of the vehicle, at negative lags that the fin responds to the motion. Its band is
2.58 sqrt(sum_k R_e(k) R_u(k) / n), as both are coloured. Source: Ljung 1999, section 16.6.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from fieldsid.figures.motion import TWO_SIDED_99, level
from fieldsid.figures.panel import Panel, Picture, Series
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.shifted_correlation import shifted_correlations

if TYPE_CHECKING:
    from fieldsid.fitting.predict.predict import Prediction

LONGEST_LAG_S = 5.0
"""Longest lag that is drawn."""


def figure(shown: Prediction, title: str) -> Picture:
    """Return a row for each measured channel: its autocorrelation, and its correlation with the fin."""
    step, rows = float(np.median(shown.record.steps)), residuals_of(shown)
    own = [autocorrelation(residual, step, f"{name} residual") for name, residual in rows]
    with_fin = [correlation_with_fin(residual, shown.fin, step) for _, residual in rows]
    shares = ", ".join(f"{name} {100.0 * share:.0f} %" for (name, _), (_, share) in zip(rows, own, strict=True))
    says = f"{title}\nlags outside the 99 % band of white noise: {shares} (white: 1 %)"
    return Picture(says, (11.0, 1.0 + 2.5 * len(rows)), ([panel for panel, _ in own], with_fin))


def residuals_of(shown: Prediction) -> list[tuple[str, FloatArray]]:
    """Return the residuals (n,) about their mean by channel, zero where nothing was measured, for measured channels."""
    known = ((name, r, ok) for name, r, ok in zip(("angle", "rate"), shown.residual, shown.record.ok, strict=True))
    return [(name, np.where(ok, r - np.mean(r[ok]), 0.0)) for name, r, ok in known if ok.sum() > 2]


def autocorrelation(residual: FloatArray, step: float, label: str = "") -> tuple[Panel, float]:
    """Return the autocorrelation of a residual (n,) sampled every step s, and the share of lags outside the band."""
    reach = _reach(residual.size, step)
    found = shifted_correlations(residual, residual, reach)[reach + 1 :]
    band = TWO_SIDED_99 / sqrt(residual.size)
    limits = min(-0.3, float(found.min()) - 0.05), max(0.5, float(found.max()) + 0.05)
    panel = _stems(np.arange(1.0, reach + 1) * step, found, band, "second", limits, label, "autocorrelation")
    return panel, float(np.mean(np.abs(found) > band))


def correlation_with_fin(residual: FloatArray, fin: FloatArray, step: float) -> Panel:
    """Return the correlation of a residual (n,) with the fin (n,) lag s before it."""
    reach = _reach(residual.size, step)
    cross = shifted_correlations(residual, fin, reach)
    both = shifted_correlations(residual, residual, reach) @ shifted_correlations(fin, fin, reach)
    band = TWO_SIDED_99 * sqrt(max(float(both), 1.0) / residual.size)
    ends = max(0.3, 1.1 * band, float(np.abs(cross).max()) + 0.05)
    title = "correlation with the fin before (lag > 0) and after it"
    return _stems(np.arange(-reach, reach + 1.0) * step, cross, band, "simulated", (-ends, ends), "", title)


def _stems(
    lags: FloatArray, values: FloatArray, band: float, kind: str, limits: tuple[float, float], label: str, title: str
) -> Panel:
    edges = level(lags, band), level(lags, -band)
    return Panel(label, (*edges, Series(lags, values, kind, form="stems")), limits=limits, x="lag, s", title=title)


def _reach(count: int, step: float) -> int:
    """Return the number of lags that are drawn: at most five seconds, and a quarter of the run."""
    return max(1, min(round(LONGEST_LAG_S / step), count // 4))
