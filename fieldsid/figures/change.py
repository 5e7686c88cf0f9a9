"""The figure of before and after: both vehicles at the same fin, the change of each parameter, the gains over speed."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.change.record import Answers, Change, GainChange, ParameterChange
from fieldsid.figures import canvas

BEFORE, AFTER = canvas.SECOND, canvas.SIMULATED


def figure(found: Change, names: tuple[str, str]) -> Figure:
    """Return a sheet: the answers to the same fin over each other, the changes in per cent, and the gains before and after."""
    sheet = canvas.sheet(11.0, 7.0)
    sheet.suptitle(found.line, x=0.01, ha="left", fontsize=12, fontweight="bold")
    shown = [p for p in found.parameters if p.is_relative and np.isfinite(p.std_error)]
    halves = sheet.subfigures(2, 1, squeeze=False, height_ratios=(1.15, 1.0))
    top, bottom = halves[0, 0], halves[1, 0]
    if found.answers is not None:
        _draw_answers(found.answers, top.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0)), names)
    axes = bottom.subplots(1, 2 if found.gains else 1, squeeze=False)[0]
    draw(shown, axes[0])
    if found.gains:
        _draw_gains(found.gains, axes[1])
    return sheet


def draw(parameters: list[ParameterChange], ax: Axes) -> None:
    """Draw the change of each parameter with its 95 % interval, in per cent, the speeds below it where there are several."""
    rows: list[tuple[str, float, tuple[float, float], bool]] = []
    for p in parameters:
        rows.append((p.word, p.change, p.interval95, True))
        if len(p.speeds) > 1:
            rows += [
                (f"{a.speed:.2f} m/s", a.change, (a.change - 1.96 * a.std_error, a.change + 1.96 * a.std_error), False)
                for a in p.speeds
            ]
    places = -np.arange(len(rows), dtype=float)
    ax.axvline(0.0, color="0.4", linewidth=0.8)
    for place, (_, change, (low, high), whole) in zip(places, rows, strict=True):
        color, size = (AFTER, 6.0) if whole else ("0.55", 4.0)
        ax.plot([100 * low, 100 * high], [place, place], color=color, linewidth=2.0 if whole else 1.2)
        ax.plot([100 * change], [place], marker="o", markersize=size, color=color)
    ax.set_yticks(places, [r[0] for r in rows])
    ax.margins(y=0.1)
    canvas.dress(ax, x="change, %, with 95 % interval", title="parameters: what changed beyond its error")


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
    ax.plot(speeds, [g.new for g in gains], marker="o", color=AFTER, label="after, 95 % band")
    ax.margins(y=0.25)
    canvas.dress(ax, x="speed, m/s", y="kp, rad/rad", title="gain that would be designed")
    canvas.legend_above(ax)
