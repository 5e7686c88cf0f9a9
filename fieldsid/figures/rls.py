"""Recursive estimates over time: one panel per parameter with its 95 % band and its settling time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.figures import canvas
from fieldsid.fitting.problem.estimator import History
from fieldsid.numerics.arrays import FloatArray
from fieldsid.rounding import TWO_SIDED_95

START_UP = 0.15
"""First share of the record, whose inaccurate estimates do not determine the scale of a panel."""


def draw(view: History, ax: Axes, index: int, unit: str) -> None:
    """Draw one parameter (by its place in `names`) over time."""
    name = view.names[index]
    value, band = view.values[:, index], TWO_SIDED_95 * view.std_errors[:, index]
    canvas.dress(ax, y=f"{name}, {unit}" if unit else name)
    ax.fill_between(view.time, value - band, value + band, color=canvas.SECOND, alpha=0.2, linewidth=0, label="95 % band")
    ax.plot(view.time, value, color=canvas.SECOND, linewidth=1.3, label="estimate")
    ax.axhline(float(value[-1]), color="0.3", linewidth=0.8, linestyle=":", label="last value")
    at = view.settled_s.get(name, float("nan"))
    if np.isfinite(at):
        when = float(view.time[0]) + at
        ax.axvline(when, color=canvas.SIMULATED, linewidth=1.1, linestyle="--", label="settled")
        ax.annotate(
            f"after {at:.1f} s", (when, 1.0), xycoords=("data", "axes fraction"), xytext=(4, -11),
            textcoords="offset points", color=canvas.SIMULATED, fontsize=9,
        )  # fmt: skip
    elif view.settled_s:
        ax.annotate("not settled", (0.99, 0.04), xycoords="axes fraction", ha="right", color=canvas.SIMULATED, fontsize=9)
    ax.set_xlim(view.time[0], view.time[-1])
    ax.set_ylim(*_scale(value, band))


def panels(view: History, units: Mapping[str, str], of: str) -> Figure:
    """Return a sheet with one panel per parameter; its title says when each settled, and what the estimates are of."""
    count = len(view.names)
    figure = canvas.sheet(9.0, 1.2 + 1.9 * count, f"{of}: {settling(view)}")
    axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    for i, ax in enumerate(axes):
        draw(view, ax, i, units.get(view.names[i], ""))
    canvas.legend_above(axes[0])
    axes[-1].set_xlabel("time, s")
    figure.align_ylabels(list(axes))
    return figure


def settling(view: History) -> str:
    """Return in words when each parameter settled."""
    ends = {name: view.settled_s.get(name, float("nan")) for name in view.names}
    settled = [f"{name} settled after {at:.1f} s" for name, at in ends.items() if np.isfinite(at)]
    return ", ".join([*settled, *(f"{name} did not" for name, at in ends.items() if not np.isfinite(at))])


def _scale(value: FloatArray, band: FloatArray) -> tuple[float, float]:
    """Return limits that show the estimate after its first wild part, and the band at the end."""
    late = slice(int(START_UP * value.size), None)
    shown = np.concatenate([value[late], [value[-1] - 2 * band[-1], value[-1] + 2 * band[-1], 0.0]])
    shown = shown[np.isfinite(shown)]
    low, high = float(shown.min()), float(shown.max())
    spare = 0.08 * max(high - low, 1e-9)
    return low - spare, high + spare
