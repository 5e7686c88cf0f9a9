"""A plan: for every leg the fin command, the predicted angle with its band inside the envelope, and the track."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from fieldsid.figures import canvas
from fieldsid.models.axis import Axis
from fieldsid.planning.output.figure_data import LegFigure

LIMIT: dict[str, Any] = {"color": "#B2182B", "linewidth": 1.1, "linestyle": (0, (4, 2))}
AREA = "#EAF1F7"
MOST_LEGS = 6


def draw(view: LegFigure, axes: Sequence[Axes]) -> None:
    """Draw one leg on three plots: command, angle with band, track."""
    draw_command(view, axes[0])
    draw_angle(view, axes[1])
    draw_track(view, axes[2])


def draw_command(view: LegFigure, ax: Axes) -> None:
    """Draw the fin in deg, solid where it is commanded, thin where the autopilot is expected to have it."""
    canvas.dress(ax, y=f"{'rudder' if view.axis is Axis.YAW else 'elevator'}, deg", title=view.title)
    fin, ours = np.degrees(view.fin), view.autopilot < 0.5
    ax.step(view.time, fin, where="post", color="0.1", linewidth=1.1, linestyle=":", label="autopilot steers")
    ax.step(view.time, np.where(ours, fin, np.nan), where="post", color=canvas.SECOND, linewidth=1.6, label="commanded")
    most = float(np.degrees(view.envelope.fin))
    for side in (-most, most):
        ax.axhline(side, **LIMIT)
    ax.set_ylim(-1.2 * most, 1.2 * most)
    ax.set_xlim(view.time[0], view.time[-1])


def draw_angle(view: LegFigure, ax: Axes) -> None:
    """Draw the predicted angle in deg with the 68 and 95 % bands over the prior, and the envelope."""
    yaw = view.axis is Axis.YAW
    canvas.dress(ax, y=f"{'heading' if yaw else 'pitch'}, deg", title=_errors(view))
    low, inner_low, inner_high, high = np.degrees(view.band)
    ax.fill_between(view.time, low, high, color=canvas.SIMULATED, alpha=0.15, linewidth=0, label="95 % of the draws")
    ax.fill_between(view.time, inner_low, inner_high, color=canvas.SIMULATED, alpha=0.3, linewidth=0, label="68 % of the draws")
    ax.plot(view.time, np.degrees(view.angle), color=canvas.SIMULATED, linewidth=1.4, label="expected")
    limit = view.envelope.heading if yaw else view.envelope.pitch
    if limit is not None:
        for side in (-limit, limit):
            ax.axhline(np.degrees(side), **LIMIT)
        reach = 1.15 * float(np.degrees(limit))
        ax.set_ylim(min(-reach, float(low.min()) * 1.05), max(reach, float(high.max()) * 1.05))
    ax.set_xlim(view.time[0], view.time[-1])


def draw_track(view: LegFigure, ax: Axes) -> None:
    """Draw the track in m, seen from above for yaw and from the side for pitch, with draws of the prior behind it."""
    yaw = view.axis is Axis.YAW
    canvas.dress(ax, y="across, m" if yaw else "depth change, m")
    for i, (along, across) in enumerate(zip(view.tracks[0], view.tracks[1], strict=True)):
        ax.plot(along, across, color=canvas.QUIET, linewidth=0.6, label="_" if i else "draw of the prior")
    ax.plot(view.along, view.across, color=canvas.SIMULATED, linewidth=1.5)
    ax.plot(view.along[:1], view.across[:1], marker="o", color=canvas.SECOND, markersize=5)
    limit = view.envelope.track if yaw else view.envelope.depth_room()
    for side in () if limit is None else (-limit, limit):
        ax.axhline(side, **LIMIT)
    _draw_area(view, ax)
    if yaw:
        ax.set_aspect("equal", adjustable="datalim")
    ax.invert_yaxis()


def _draw_area(view: LegFigure, ax: Axes) -> None:
    """Draw the available area: it begins where the run-up does; its width is shown from above only."""
    length, width = view.envelope.area_length, view.envelope.area_width
    begin = -view.run_up_m
    if view.axis is Axis.YAW and length is not None and width is not None:
        ax.add_patch(Rectangle((begin, -0.5 * width), length, width, facecolor=AREA, edgecolor="none", zorder=0))
        ax.autoscale_view()
    for end in () if length is None else (begin, begin + length):
        ax.axvline(end, **LIMIT)
    if view.axis is Axis.YAW and width is not None:
        for side in (-0.5, 0.5):
            ax.axhline(side * width, **LIMIT)


def figure(views: Sequence[LegFigure]) -> Figure:
    """Return a sheet of up to six legs, one row each."""
    shown = views[:MOST_LEGS]
    sheet = canvas.sheet(13.0, 0.9 + 2.3 * len(shown))
    grid = sheet.subplots(len(shown), 3, squeeze=False, width_ratios=(1.15, 1.15, 1.0))
    for view, row in zip(shown, grid, strict=True):
        draw(view, row)
    for ax, label in zip(grid[-1], ("time, s", "time, s", "along, m"), strict=True):
        ax.set_xlabel(label)
    handles = [h for ax in grid[0] for h in ax.get_legend_handles_labels()[0]]
    handles.append(Line2D([], [], label="limit", **LIMIT))
    if any(v.envelope.area_length is not None for v in shown):
        handles.append(Patch(color=AREA, label="area"))
    sheet.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False, fontsize=9)
    return sheet


def _errors(view: LegFigure) -> str:
    """Return the expected errors in words."""
    known = ", ".join(f"{name} {error}" for name, error in view.errors.items())
    return f"known afterwards to {known} (std error)" if known else ""
