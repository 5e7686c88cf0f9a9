"""Pictures drawn with matplotlib: every panel, band and bar of every figure, in the same colours."""

from __future__ import annotations

from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.figures import canvas
from fieldsid.figures.panel import Bars, Cell, Panel, Picture, Series

COLOURS = {
    "measured": canvas.MEASURED, "simulated": canvas.SIMULATED, "second": canvas.SECOND, "third": canvas.THIRD,
    "fourth": canvas.FOURTH, "warm": canvas.WARM, "quiet": "0.45", "fin": "0.2", "odd": "red", "limit": "#B2182B",
    "port": canvas.SIMULATED, "starboard": canvas.SECOND,
}  # fmt: skip
"""The colour of each kind of series; other kinds are colours themselves."""
LABEL_WIDTH, TITLE_WIDTH = 30, 9.0
"""Letters in a line of a bar's name, and in an inch of a panel's title."""
BELOW = 0.36
"""Distance of a ring below the middle of its bar, as the label is next to the bar."""


def rendered(picture: Picture) -> Figure:
    """Return the figure of a picture."""
    sheet = canvas.sheet(*picture.size, picture.title)
    parts = sheet.subfigures(1, len(picture.columns), squeeze=False, width_ratios=picture.widths)[0]
    shares = np.array(picture.widths or [1.0] * len(parts))
    for part, cells, share in zip(parts, picture.columns, shares / shares.sum(), strict=True):
        heights = [c.height if isinstance(c, Panel) else 130 for c in cells]
        shared = all(isinstance(c, Panel) and not c.x for c in cells[:-1])
        axes = part.subplots(len(cells), 1, squeeze=False, sharex=shared, height_ratios=heights)[:, 0]
        named: set[str] = set()
        for cell, ax in zip(cells, axes, strict=True):
            width = round(TITLE_WIDTH * share * picture.size[0])
            draw(cell, ax, width)
            names = set(ax.get_legend_handles_labels()[1])
            if names - named:
                canvas.legend_above(ax, width)
            named |= names
        part.align_ylabels(list(axes))
    return sheet


def draw(cell: Cell, ax: Axes, width: int) -> None:
    """Draw a part of a picture without its legend; width: letters in a line of its title."""
    if isinstance(cell, Panel):
        draw_panel(cell, ax)
    elif isinstance(cell, Bars):
        draw_bars(cell, ax)
    else:
        cell(ax)
        return
    ax.set_title("\n".join(fill(line, width) for line in cell.title.splitlines()), loc="left", fontsize=10)


def draw_panel(panel: Panel, ax: Axes) -> None:
    """Draw the areas, lines and shaded spans of a panel; the x axis ends where the data do."""
    canvas.dress(ax, x=panel.x, y=panel.label)
    for b in panel.bands:
        ax.fill_between(b.x, b.low, b.high, color=COLOURS.get(b.kind, b.kind), alpha=0.16, linewidth=0, label=b.name or "_")
    for s in panel.series:
        _draw_series(s, ax)
    for start, end in panel.spans:
        ax.axvspan(start, end, color=canvas.WARM, alpha=0.18, linewidth=0)
    x = np.concatenate([s.x[np.isfinite(s.x)] for s in panel.series])
    spare = 0.03 * float(np.ptp(x)) if any(s.form in ("points", "rings") for s in panel.series) else 0.0
    if np.ptp(x):
        ax.set_xlim(float(x.min()) - spare, float(x.max()) + spare)
    if panel.from_zero:
        ax.set_ylim(min(0.0, ax.get_ylim()[0]), max(0.0, ax.get_ylim()[1]))
    if panel.limits is not None:
        ax.set_ylim(*panel.limits)


def _draw_series(s: Series, ax: Axes) -> None:
    colour, label = COLOURS.get(s.kind, s.kind), s.name or "_"
    if s.form == "dots":
        canvas.dots(ax, s.x, s.y, label)
    elif s.form == "stems":
        ax.vlines(s.x, 0.0, s.y, color=colour, linewidth=1.0, label=label)
    elif s.form in ("points", "rings"):
        face = colour if s.form == "points" else "white"
        ax.errorbar(
            s.x, s.y, yerr=s.error, fmt="o", color=colour, markerfacecolor=face, markersize=5, capsize=3, linewidth=1.0, zorder=5,
            label=label,
        )  # fmt: skip
    else:
        width, steps = (0.6 if s.thin else 1.3), ("steps-post" if s.form == "steps" else "default")
        ax.plot(s.x, s.y, "--" if s.dashed else "-", color=colour, linewidth=width, drawstyle=steps, label=label)


def draw_bars(bars: Bars, ax: Axes) -> None:
    """Draw bars with their words, rings below them, and the line at 1."""
    canvas.dress(ax, x=bars.label)
    rows = list(range(len(bars.rows)))[::-1]
    colours = [canvas.SIMULATED if b.stands_out else canvas.QUIET for b in bars.rows]
    ax.barh(rows, [b.value for b in bars.rows], color=colours, height=0.5, label=bars.name or "_")
    if bars.ring_name:
        rings = ([b.ring for b in bars.rows], [row - BELOW for row in rows])
        ax.plot(*rings, "o", markerfacecolor="white", markeredgecolor="0.25", markersize=6, label=bars.ring_name)
    if bars.mark:
        ax.axvline(1.0, color=canvas.SECOND, linewidth=1.4, linestyle="--", label=bars.mark)
    for row, b in zip(rows, bars.rows, strict=True):
        canvas.note(ax, b.says, (min(b.value, bars.end), row), (7, 0), va="center")
    ax.set_yticks(rows, [fill(b.name.replace("+", " +"), LABEL_WIDTH) for b in bars.rows], fontsize=9)
    longest = max((len(b.says) for b in bars.rows), default=0)
    ax.set_xlim(0.0, (1.15 + longest / 60.0) * bars.end)
    ax.grid(visible=False, axis="y")
