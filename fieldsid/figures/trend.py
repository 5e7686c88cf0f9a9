"""The figure of an archive: each parameter over the runs' dates with its errors, its stretches, and where it changed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from functools import partial
from importlib import import_module
from math import isfinite
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fieldsid.batch.trend import Trend
from fieldsid.figures import canvas
from fieldsid.figures.panel import Picture
from fieldsid.rounding import TWO_SIDED_95

DATES: Any = import_module("matplotlib.dates")  # its functions have no types
FORMATS = ("%Y", "%b\n%Y", "%d %b", "%H:%M", "%H:%M", "%S.%f")
"""Formats of ticks at a year, a month, a day, an hour, a minute, a second."""
OF_FIRST = ("", "%b\n%Y", "%b\n%Y", "%d %b\n%Y", "%H:%M", "%H:%M")
"""The same for the first of each: no tick beyond the axis is needed to know the year."""


def figure(trends: Sequence[Trend], name: str) -> Picture:
    """Return a part for each parameter, one below the other."""
    cells = [partial(draw, trend) for trend in trends]
    return Picture(f"{name}: {summary(trends)}", (10.0, 1.2 + 2.3 * len(trends)), (cells,))


def summary(trends: Sequence[Trend]) -> str:
    """Return what changed, in words."""
    changes = [f"{t.name} {_by(c.share)} on {c.start_utc[:10]}" for t in trends for c in t.changes]
    changes += [f"{t.name} {_by(t.drift.share)} little by little" for t in trends if t.drift is not None]
    count = max((t.values.size for t in trends), default=0)
    return f"{', '.join(changes)}; {count} runs" if changes else f"no change beyond errors and scatter in {count} runs"


def draw(trend: Trend, ax: Axes) -> None:
    """Draw one parameter: runs with 95 % errors, the mean of each stretch and a line at each change, or the drift."""
    dates = DATES.date2num([datetime.fromtimestamp(t, UTC) for t in trend.start.tolist()])
    ax.errorbar(
        dates, trend.values, TWO_SIDED_95 * trend.std_errors, fmt="o", markersize=3.2, color=canvas.MEASURED, elinewidth=0.8,
        label="run, 95 % error",
    )  # fmt: skip
    cuts = np.flatnonzero(np.diff(trend.means)) + 1 if trend.drift is None else np.zeros(0, dtype=np.intp)
    for i, part in enumerate(np.split(np.arange(trend.values.size), cuts)):
        ends, label = part[[0, -1]], "mean" if trend.drift is None else "drift"
        ax.plot(dates[ends], trend.means[ends], color=canvas.SECOND, linewidth=2.0, label="_" if i else label)
    for i, (cut, change) in enumerate(zip(cuts.tolist(), trend.changes, strict=True)):
        at = 0.5 * (dates[cut - 1] + dates[cut])
        ax.axvline(at, color=canvas.SIMULATED, linestyle="--", linewidth=1.2, label="_" if i else "change")
        canvas.note(ax, _by(change.share), (at, 0.5), xycoords=("data", "axes fraction"), color=canvas.SIMULATED)
    at_speed = f" at {trend.speed:.2f} m/s" if isfinite(trend.speed) else ""
    canvas.dress(ax, x="start of the run, UTC", y=f"{trend.name}{at_speed}")
    locator = DATES.AutoDateLocator()
    ax.xaxis.set_major_locator(locator)
    ax.xaxis.set_major_formatter(DATES.ConciseDateFormatter(locator, formats=FORMATS, zero_formats=OF_FIRST, show_offset=False))


def _by(share: float) -> str:
    return f"{100.0 * share:+.0f} %" if isfinite(share) else "changed"
