"""Recursive estimates over time: one panel per parameter with its 95 % band and its settling time."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from fieldsid.figures.motion import level
from fieldsid.figures.panel import Band, Panel, Picture, Series
from fieldsid.fitting.problem.estimator import History
from fieldsid.numerics.arrays import FloatArray
from fieldsid.rounding import TWO_SIDED_95

if TYPE_CHECKING:
    from matplotlib.axes import Axes

START_UP = 0.15
"""First share of the record, whose inaccurate estimates do not determine the scale of a panel."""


def figure(view: History, units: Mapping[str, str], of: str) -> Picture:
    """Return one panel per parameter; the title says when each settled, and what the estimates are of."""
    cells = [partial(draw, view, i, units.get(name, "")) for i, name in enumerate(view.names)]
    return Picture(f"{of}: {settling(view)}", (9.0, 1.2 + 1.9 * len(cells)), (cells,))


def draw(view: History, index: int, unit: str, ax: Axes) -> None:
    """Draw one parameter (by its place in `names`) over time, and when it settled."""
    from fieldsid.figures import canvas, drawn

    name = view.names[index]
    value, band = view.values[:, index], TWO_SIDED_95 * view.std_errors[:, index]
    area = Band(view.time, value - band, value + band, "second", "95 % band")
    lines = Series(view.time, value, "second", "estimate"), level(view.time, float(value[-1]), "last value")
    x = "time, s" if name == view.names[-1] else ""
    drawn.draw_panel(Panel(f"{name}, {unit}" if unit else name, lines, (area,), limits=_scale(value, band), x=x), ax)
    at = view.settled_s.get(name, float("nan"))
    if np.isfinite(at):
        when = float(view.time[0]) + at
        ax.axvline(when, color=canvas.SIMULATED, linewidth=1.1, linestyle="--", label="settled")
        canvas.note(ax, f"after {at:.1f} s", (when, 1.0), (4, -11), xycoords=("data", "axes fraction"), color=canvas.SIMULATED)
    elif view.settled_s:
        ax.annotate("not settled", (0.99, 0.04), xycoords="axes fraction", ha="right", color=canvas.SIMULATED, fontsize=9)


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
