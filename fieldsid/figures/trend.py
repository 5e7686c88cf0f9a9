"""The figure of an archive: each parameter over the runs' dates with its errors, its stretches, and where it changed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from functools import partial
from importlib import import_module
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldsid.batch.trend import Change, Drift, Trend
from fieldsid.figures.panel import Picture
from fieldsid.rounding import TWO_SIDED_95, number, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORMATS = ("%Y", "%b\n%Y", "%d %b", "%H:%M", "%H:%M", "%S.%f")
"""Formats of ticks at a year, a month, a day, an hour, a minute, a second."""
OF_FIRST = ("", "%b\n%Y", "%b\n%Y", "%d %b\n%Y", "%H:%M", "%H:%M")
"""The same for the first of each: no tick beyond the axis is needed to know the year."""


def figure(trends: Sequence[Trend], name: str) -> Picture:
    """Return a part for each parameter, one below the other."""
    cells = [partial(draw, trend) for trend in trends]
    says = "; ".join(line for t in trends for line in lines_of(t))
    return Picture(f"{name}: {says}", (10.0, 1.2 + 2.3 * len(trends)), (cells,))


def lines_of(trend: Trend) -> Iterator[str]:
    """Yield a line for each date at which a parameter changed, or for its drift, with the amount."""
    for c in trend.changes:
        yield f"{trend.name} changed by {_amount(trend, c)} on {c.start_utc[:10]}, from `{c.run}` on"
    if trend.drift is not None:
        first, last = (datetime.fromtimestamp(t, UTC).date().isoformat() for t in trend.start[[0, -1]].tolist())
        yield f"{trend.name} drifted by {_amount(trend, trend.drift)} from {first} to {last}, little by little"
    elif not trend.changes:
        yield f"{trend.name}: no change beyond errors and scatter in {trend.runs} runs"


def _amount(trend: Trend, change: Change | Drift) -> str:
    """Return a change with its standard error in per cent, in its unit where the value before was zero."""
    if not change.before:
        return f"{number(change.after - change.before, 2)} {trend.name}"
    return f"{with_error(100.0 * change.share, 100.0 * change.std_error / abs(change.before))} %"


def draw(trend: Trend, ax: Axes) -> None:
    """Draw one parameter: runs with 95 % errors, the mean of each stretch and a line at each change, or the drift."""
    from fieldsid.figures import canvas

    matplotlib_dates: Any = import_module("matplotlib.dates")  # its functions have no types
    dates = matplotlib_dates.date2num([datetime.fromtimestamp(t, UTC) for t in trend.start.tolist()])
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
        canvas.note(ax, _amount(trend, change), (at, 0.5), (4, 0), xycoords=("data", "axes fraction"), color=canvas.SIMULATED)
    at_speed = f" at {trend.speed:.2f} m/s" if isfinite(trend.speed) else ""
    canvas.dress(ax, x="start of the run, UTC", y=f"{trend.name}{at_speed}")
    locator = matplotlib_dates.AutoDateLocator()
    ax.xaxis.set_major_locator(locator)
    formats = {"formats": FORMATS, "zero_formats": OF_FIRST, "show_offset": False}
    ax.xaxis.set_major_formatter(matplotlib_dates.ConciseDateFormatter(locator, **formats))
