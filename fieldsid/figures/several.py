"""The figure of several models over one run: what was measured, and each model's free run over it."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.comparison.compare import Comparison
from fieldsid.figures import canvas

TITLE_WIDTH = 110


def figure(found: Sequence[Comparison], names: Sequence[str]) -> Figure:
    """Return a sheet of one run: angle, rate, the residual of each model in the most informative channel, and the fin."""
    over = ", ".join(f"{n} {c.over_noise:.2f} x" for n, c in zip(names, found, strict=True))
    sheet = canvas.sheet(10.0, 7.5, fill(f"{found[0].run}: error over the noise: {over}", TITLE_WIDTH))
    axes = sheet.subplots(4, 1, sharex=True, height_ratios=(1.2, 1.2, 0.9, 0.6))
    record = found[0].shown.record
    for ax, values, ok in ((axes[0], record.angle, record.angle_ok), (axes[1], record.rate, record.rate_ok)):
        if ok.any():
            canvas.dots(ax, record.time[ok], np.degrees(values[ok]))
    for color, name, one in zip(canvas.SERIES * len(found), names, found, strict=False):
        draw(one, name, color, axes[:3])
    canvas.dress(axes[0], y="angle, deg")
    canvas.legend_above(axes[0])
    canvas.dress(axes[1], y="rate, deg/s")
    canvas.dress(axes[2], y="rate error, deg/s" if record.rate_ok.any() else "angle error, deg")
    axes[3].step(record.time, np.degrees(record.fin), where="post", color="0.35", linewidth=1.2)
    canvas.dress(axes[3], x="time, s", y="fin, deg")
    sheet.align_ylabels(list(axes))
    return sheet


def draw(one: Comparison, name: str, color: str, axes: Sequence[Axes]) -> None:
    """Draw one model's angle and rate, and measured less simulated rate, or angle where no rate was measured, in degrees."""
    shown = one.shown
    axes[0].plot(shown.record.time, np.degrees(shown.angle), color=color, linewidth=1.3, label=name)
    axes[1].plot(shown.record.time, np.degrees(shown.rate), color=color, linewidth=1.3)
    record, ok = shown.record, shown.record.rate_ok
    error = record.rate - shown.rate if ok.any() else record.angle - shown.angle
    ok = ok if ok.any() else record.angle_ok
    axes[2].plot(record.time[ok], np.degrees(error[ok]), color=color, linewidth=0.9)
