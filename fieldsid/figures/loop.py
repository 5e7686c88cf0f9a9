"""The figure of the modelling loop: where the first model fails, the free run with the effects added, the error step by step."""

from __future__ import annotations

from math import isfinite
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.comparison.compare import Comparison
from fieldsid.extension.lineage import Loop
from fieldsid.figures import canvas, where
from fieldsid.figures.history import folded
from fieldsid.rounding import DEGREES

MOST_BARS, TITLE_WIDTH = 8, 120


def figure(found: Loop) -> Figure:
    """Return a sheet of four panels: failure of the first model, its places, the last model, the error after each step."""
    sheet = canvas.sheet(13.0, 8.4, fill(headline(found), TITLE_WIDTH))
    (top, places), (bottom, fall) = sheet.subplots(2, 2, width_ratios=(1.5, 1.0))
    draw_motion(found, top, [(found.start, found.before, canvas.SECOND)])
    top.set_title(f"1. the {found.start} fails: {found.left_by(found.before)}", loc="left", fontsize=10)
    named = "+".join(found.added)
    draw_motion(found, bottom, [(found.start, found.before, canvas.SECOND), (f"with {named}", found.after, canvas.SIMULATED)])
    bottom.set_title(fill(f"3. with {named}: {found.left_by(found.after)}", 70), loc="left", fontsize=10)
    bottom.set_xlabel("time, s")
    where.draw(found.where[:MOST_BARS], places)
    places.set_title("2. where; beside a bar: rms there over that of the run", loc="left", fontsize=10)
    draw_steps(found, fall)
    fall.set_title("4. the error step by step", loc="left", fontsize=10)
    for ax in (top, bottom, fall):
        canvas.legend_above(ax)
    return sheet


def headline(found: Loop) -> str:
    """Return the loop in one sentence."""
    at = f", most at {DEGREES.words(found.where[0].condition)}" if found.where else ""
    before, after = found.left_by(found.before), found.left_by(found.after)
    return f"{found.before.run}: {found.start} {before}{at}; with {', '.join(found.added)} {after}"


def draw_motion(found: Loop, ax: Axes, models: list[tuple[str, Comparison, str]]) -> None:
    """Draw the channel that the first model fails most in, measured and by each model, its worst stretches shaded."""
    record, is_rate = found.before.shown.record, found.before.worst_channel.name == "rate"
    values, ok = (record.rate, record.rate_ok) if is_rate else (record.angle, record.angle_ok)
    canvas.dress(ax, y=f"{record.axis.value} rate, deg/s" if is_rate else f"{record.axis.value}, deg")
    canvas.dots(ax, record.time[ok], np.degrees(values[ok]))
    for name, one, colour in models:
        ax.plot(record.time, np.degrees(one.shown.rate if is_rate else one.shown.angle), color=colour, linewidth=1.3, label=name)
    for stretch in found.before.worst_channel.worst:
        ax.axvspan(stretch.start_s, stretch.end_s, color=canvas.WARM, alpha=0.18, linewidth=0)
    ax.set_xlim(record.time[0], record.time[-1])


def draw_steps(found: Loop, ax: Axes) -> None:
    """Draw the error on unseen and on fitted runs after each addition, the noise floor at 1."""
    canvas.dress(ax, y="free-run error over " + ("that of the first model" if found.is_noiseless else "the noise floor"))
    steps = found.steps
    x = range(len(steps))
    fitted, unseen = [s.fitted for s in steps], [s.unseen for s in steps]
    ax.plot(x, fitted, "o:", color="0.45", markerfacecolor="white", markersize=6, label="fitted runs")
    judged = any(isfinite(v) for v in unseen)
    if judged:
        ax.plot(x, unseen, "o-", color=canvas.SIMULATED, linewidth=2.0, markersize=7, label="unseen runs")
    if not found.is_noiseless:
        ax.axhline(1.0, color=canvas.THIRD, linestyle="--", linewidth=1.3, label="noise floor")
    for at, step in enumerate(steps):
        place = (at, step.unseen if judged else step.fitted)
        ax.annotate(step.says[judged], place, xytext=(7, 6), textcoords="offset points", fontsize=9)
    ax.set_xticks(x, [folded(s.added) for s in steps], fontsize=9)
    ax.set_xlim(-0.3, len(steps) - 0.4)
    ax.set_ylim(0.0, 1.15 * max(v for v in (*fitted, *unseen, 1.0) if isfinite(v)))
    ax.grid(visible=False, axis="x")
