"""The figure of before and after: both vehicles at the same fin, the change of each parameter, the gains over speed."""

from __future__ import annotations

from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.change.record import CHANGED, Answers, Change, GainChange, ParameterChange
from fieldsid.figures import canvas
from fieldsid.rounding import TWO_SIDED_95

TITLE_WIDTH = 100
MOST_TIMES = 3.0
"""Multiple of the gains at which a band is cut: a wider one only shows that the gains are not known."""
BEFORE, AFTER = canvas.SECOND, canvas.SIMULATED


def figure(found: Change, names: tuple[str, str]) -> Figure:
    """Return a sheet: the answers to the same fin over each other, the changes in per cent, and the gains before and after."""
    sheet = canvas.sheet(11.0, 7.0)
    sheet.suptitle(fill(found.line, TITLE_WIDTH), x=0.01, ha="left", fontsize=12, fontweight="bold")
    shown = [p for p in found.parameters if p.is_relative and np.isfinite(p.std_error)]
    halves = sheet.subfigures(2, 1, squeeze=False, height_ratios=(1.15, 1.0))
    top, bottom = halves[0, 0], halves[1, 0]
    if found.answers is not None:
        _draw_answers(found.answers, top.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0)), names)
    panels = bottom.subplots(1, max(bool(shown) + bool(found.gains), 1), squeeze=False)[0]
    if shown:
        draw(shown, panels[0])
    if found.gains:
        _draw_gains(found.gains, panels[-1])
    elif not shown:
        panels[0].set_axis_off()
    return sheet


def draw(parameters: list[ParameterChange], ax: Axes) -> None:
    """Draw the change of each parameter with its 95 % interval, in per cent, the speeds below it where there are several."""
    rows: list[tuple[str, float, tuple[float, float], bool]] = []
    for p in parameters:
        rows.append((p.word, p.change, p.interval95, True))
        if len(p.speeds) > 1:
            rows += [
                (f"{a.speed:.2f} m/s", a.change, (a.change - reach, a.change + reach), False)
                for a, reach in ((a, TWO_SIDED_95 * a.std_error) for a in p.speeds)
            ]
    places = -np.arange(len(rows), dtype=float)
    ax.axvline(0.0, color="0.4", linewidth=0.8)
    for place, (_, change, (low, high), is_total) in zip(places, rows, strict=True):
        color, size = (AFTER, 6.0) if is_total else ("0.55", 4.0)
        ax.plot([100 * low, 100 * high], [place, place], color=color, linewidth=2.0 if is_total else 1.2)
        ax.plot([100 * change], [place], marker="o", markersize=size, color=color)
    ax.set_yticks(places, [r[0] for r in rows])
    ax.margins(y=0.1)
    canvas.dress(ax, x="change, %, with 95 % interval", title=_what_changed(parameters))


def _what_changed(parameters: list[ParameterChange]) -> str:
    """Return which parameters have changed beyond their errors."""
    changed = [p.word for p in parameters if p.state == CHANGED]
    return f"beyond its error changed: {', '.join(changed) or 'nothing'}"


def _draw_answers(both: Answers, axes: np.ndarray, names: tuple[str, str]) -> None:
    rate, fin = axes
    for values, color, name in ((both.old_rate, BEFORE, names[0]), (both.new_rate, AFTER, names[1])):
        rate.plot(both.time, np.degrees(values), color=color, linewidth=1.6, label=name)
    canvas.dress(rate, y="rate, deg/s", title=f"both models at the same fin, {both.speed:.2f} m/s")
    canvas.legend_above(rate)
    fin.step(both.time, np.degrees(both.fin), where="post", color="0.35", linewidth=1.2)
    canvas.dress(fin, x="time, s", y="fin, deg")


def _draw_gains(gains: tuple[GainChange, ...], ax: Axes) -> None:
    speeds = [g.speed for g in gains]
    ax.plot(speeds, [g.old for g in gains], marker="o", color=BEFORE, label="before")
    low, high = ([(1 + g.interval95[i]) * g.old for g in gains] for i in (0, 1))
    ax.fill_between(speeds, low, high, color=AFTER, alpha=0.18, linewidth=0)
    ax.vlines(speeds, low, high, color=AFTER, alpha=0.5, linewidth=1.2)  # a band over one speed has no width
    ax.plot(speeds, [g.new for g in gains], marker="o", color=AFTER, label="after, 95 % band")
    ax.margins(x=0.15, y=0.25)
    known = [v for v in (*(g.old for g in gains), *(g.new for g in gains)) if np.isfinite(v)]
    reach = MOST_TIMES * max((abs(v) for v in known), default=1.0)
    ax.set_ylim(*np.clip(ax.get_ylim(), -reach, reach))
    least, most = (f([100 * g.change for g in gains]) for f in (min, max))
    span = f"{least:+.0f} %" if round(least) == round(most) else f"{least:+.0f} to {most:+.0f} %"
    canvas.dress(ax, x="speed, m/s", y="kp, rad/rad", title=f"the gain that would be designed changes by {span}")
    canvas.legend_above(ax)
