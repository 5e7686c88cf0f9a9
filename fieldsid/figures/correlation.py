"""The figure of a fit's residuals: autocorrelation, and correlation with the fin, each with its 99 % band.

The autocorrelation of white residuals stays within 2.58/sqrt(n). A cross-correlation with the fin at positive lags shows that the
model lacks something of the vehicle, at negative lags that the fin responds to the motion. Its band is
2.58 sqrt(sum_k R_e(k) R_u(k) / n), as both are coloured. Source: Ljung 1999, section 16.6.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.figures import canvas
from fieldsid.figures.motion import MotionView
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.shifted_correlation import shifted_correlations

LONGEST_LAG_S, MOST_LAGS = 5.0, 400


def figure(view: MotionView, title: str) -> Figure:
    """Return a sheet with a row for each measured channel: its autocorrelation, and its correlation with the fin."""
    rows = residuals_of(view)
    sheet = canvas.sheet(11.0, 1.0 + 2.5 * len(rows))
    axes = sheet.subplots(len(rows), 2, squeeze=False, sharex="col")
    shares = []
    for (name, residual), (left, right) in zip(rows, axes, strict=True):
        step = float(np.median(view.record.steps))
        share = draw_autocorrelation(residual, step, left)
        draw_with_fin(residual, view.fin, step, right)
        canvas.dress(left, y=f"{name} residual")
        shares.append(f"{name} {100.0 * share:.0f} %")
    axes[0, 0].set_title("autocorrelation", loc="left", fontsize=10)
    axes[0, 1].set_title("correlation with the fin before (lag > 0) and after it", loc="left", fontsize=10)
    for ax in axes[-1]:
        ax.set_xlabel("lag [s]")
    sheet.suptitle(f"{title}\nlags outside the 99 % band of white noise: {', '.join(shares)} (white: 1 %)", x=0.01, ha="left",
                   fontsize=11)  # fmt: skip
    return sheet


def residuals_of(view: MotionView) -> list[tuple[str, FloatArray]]:
    """Return the residuals (n,) in deg or deg/s by channel, zero where nothing was measured, for measured channels."""
    pairs = (
        ("angle", view.measured_angle - np.degrees(view.angle)),
        ("rate", view.measured_rate - np.degrees(view.rate)),
    )
    known = ((name, residual, np.isfinite(residual)) for name, residual in pairs)
    return [(name, np.where(ok, r - np.mean(r[ok]), 0.0)) for name, r, ok in known if ok.sum() > 2]


def draw_autocorrelation(residual: FloatArray, step: float, ax: Axes) -> float:
    """Draw the autocorrelation of a residual (n,) sampled every step s; return the share of lags outside the band."""
    reach = _reach(residual.size, step)
    autocorrelation = shifted_correlations(residual, residual, reach)[reach + 1 :]
    band = canvas.TWO_SIDED_99 / sqrt(residual.size)
    lags = step * np.arange(1, reach + 1)
    canvas.band(ax, band)
    ax.vlines(lags, 0.0, autocorrelation, color=canvas.SECOND, linewidth=1.0)
    ax.axhline(0.0, color="0.4", linewidth=0.8)
    ax.set_ylim(min(-0.3, float(autocorrelation.min()) - 0.05), max(0.5, float(autocorrelation.max()) + 0.05))
    return float(np.mean(np.abs(autocorrelation) > band))


def draw_with_fin(residual: FloatArray, fin: FloatArray, step: float, ax: Axes) -> None:
    """Draw the correlation of a residual (n,) with the fin (n,) lag s before it."""
    reach = _reach(residual.size, step)
    cross = shifted_correlations(residual, fin, reach)
    both = shifted_correlations(residual, residual, reach) @ shifted_correlations(fin, fin, reach)
    band = canvas.TWO_SIDED_99 * sqrt(max(float(both), 1.0) / residual.size)
    canvas.dress(ax)
    canvas.band(ax, band)
    ax.vlines(step * np.arange(-reach, reach + 1), 0.0, cross, color=canvas.SIMULATED, linewidth=1.0)
    ax.axhline(0.0, color="0.4", linewidth=0.8)
    ax.axvline(0.0, color="0.4", linewidth=0.8)
    ends = max(0.3, 1.1 * band, float(np.abs(cross).max()) + 0.05)
    ax.set_ylim(-ends, ends)


def _reach(count: int, step: float) -> int:
    """Return the number of lags that are drawn: at most five seconds, a quarter of the run, and a number of lines."""
    return max(1, min(round(LONGEST_LAG_S / step), count // 4, MOST_LAGS))
