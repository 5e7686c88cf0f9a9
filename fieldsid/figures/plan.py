"""A plan: for every leg the fin command, the predicted angle with its band inside the envelope, and the track."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldsid.figures.motion import level
from fieldsid.figures.panel import Band, Panel, Picture, Series
from fieldsid.models.axis import Axis
from fieldsid.planning.output.figure_data import LegFigure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LIMIT: dict[str, Any] = {"color": "#B2182B", "linewidth": 1.1, "linestyle": (0, (4, 2))}
AREA = "#EAF1F7"
MOST_LEGS = 6


def command(view: LegFigure, x: str) -> Panel:
    """Return the fin in deg, solid where it is commanded, thin where the autopilot is expected to have it."""
    fin, ours = np.degrees(view.fin), view.autopilot < 0.5
    most = float(np.degrees(view.envelope.fin))
    series = (
        Series(view.time, fin, "fin", "autopilot steers", "steps", thin=True),
        Series(view.time, np.where(ours, fin, np.nan), "second", "commanded", "steps"),
        *_edges(view, most),
    )
    label = f"{'rudder' if view.axis is Axis.YAW else 'elevator'}, deg"
    return Panel(label, series, limits=(-1.2 * most, 1.2 * most), x=x, title=view.title)


def angle(view: LegFigure, x: str) -> Panel:
    """Return the predicted angle in deg with the 68 and 95 % bands over the prior, and the envelope."""
    yaw = view.axis is Axis.YAW
    low, inner_low, inner_high, high = np.degrees(view.band)
    bands = (
        Band(view.time, low, high, "simulated", "95 % of the draws"),
        Band(view.time, inner_low, inner_high, "simulated", "68 % of the draws"),
    )
    limit, limits = view.envelope.heading if yaw else view.envelope.pitch, None
    if limit is not None:
        reach = 1.15 * float(np.degrees(limit))
        limits = min(-reach, float(low.min()) * 1.05), max(reach, float(high.max()) * 1.05)
    series = (Series(view.time, np.degrees(view.angle), "simulated", "expected"), *_edges(view, limit and np.degrees(limit)))
    known = ", ".join(f"{name} {error}" for name, error in view.errors.items())
    title = f"known afterwards to {known} (std error)" if known else ""
    return Panel(f"{'heading' if yaw else 'pitch'}, deg", series, bands, limits=limits, x=x, title=title)


def _edges(view: LegFigure, limit: float | None) -> tuple[Series, ...]:
    """Return the two ends of what is allowed; none where there is no limit."""
    sides = () if limit is None else (("limit", limit), ("", -limit))
    return tuple(level(view.time, side, name, "limit") for name, side in sides)


def draw_track(view: LegFigure, x: str, ax: Axes) -> None:
    """Draw the track in m, seen from above for yaw and from the side for pitch, with draws of the prior behind it."""
    yaw = view.axis is Axis.YAW
    from fieldsid.figures import canvas

    canvas.dress(ax, x=x, y="across, m" if yaw else "depth change, m")
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
        ax.fill_between([begin, begin + length], -0.5 * width, 0.5 * width, color=AREA, linewidth=0, zorder=0, label="area")
    for end in () if length is None else (begin, begin + length):
        ax.axvline(end, **LIMIT)
    if view.axis is Axis.YAW and width is not None:
        for side in (-0.5, 0.5):
            ax.axhline(side * width, **LIMIT)


def figure(views: Sequence[LegFigure]) -> Picture:
    """Return a row for each of up to six legs: command, angle and track."""
    shown = views[:MOST_LEGS]
    last = [v is shown[-1] for v in shown]
    columns = (
        [command(v, "time, s") for v in shown],
        [angle(v, "time, s") for v in shown],
        [partial(draw_track, v, "along, m" if end else "") for v, end in zip(shown, last, strict=True)],
    )
    return Picture("", (13.0, 0.9 + 2.6 * len(shown)), columns, (1.15, 1.15, 1.0))
