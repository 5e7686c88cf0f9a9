"""A schedule: gains and feed-forward over speed, margins with the least over the identified set, and steps at every speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.figures import canvas
from fieldsid.schedule.record import Schedule
from fieldsid.schedule.response import Steps
from fieldsid.schedule.verify import STEP_ANGLE_RAD, Check, Verification

SHOWN_S = 25.0


def figure(schedule: Schedule, verification: Verification) -> Figure:
    """Return gains, feed-forward and margins over speed at the left, steps of schedule and constant gain at the right."""
    sheet = canvas.sheet(12.0, 8.0)
    left, right = np.asarray(sheet.subfigures(1, 2, width_ratios=(1.0, 1.15)), dtype=object)
    gains, forward, margins = np.ravel(left.subplots(3, 1, sharex=True))
    draw_gains(schedule, gains)
    draw_forward(schedule, forward)
    draw_margins(verification.scheduled, margins)
    scheduled, constant = np.ravel(right.subplots(2, 1, sharex=True, sharey=True))
    size = STEP_ANGLE_RAD[schedule.axis]
    draw_steps([(u, s) for u, s, _ in verification.steps], size, scheduled)
    draw_steps([(u, s) for u, _, s in verification.steps], size, constant)
    scheduled.set_title(f"{schedule.kind} schedule: step of {np.degrees(size):.0f}°", loc="left", fontsize=10)
    constant.set_title(f"one constant gain, kp = {verification.constant_row.gains.kp:.3g}", loc="left", fontsize=10)
    constant.set_xlabel("time, s")
    return sheet


def gains_figure(schedule: Schedule) -> Figure:
    """Return gains, feed-forward and the phase margin at the estimate over speed, one above the other."""
    sheet = canvas.sheet(8.0, 8.0)
    gains, forward, margin = np.ravel(sheet.subplots(3, 1, sharex=True))
    draw_gains(schedule, gains)
    draw_forward(schedule, forward)
    phase = schedule.column("phase_margin_deg")
    margin.plot(schedule.speeds, phase, "o-", color=canvas.SECOND, markersize=4)
    canvas.dress(margin, x="speed, m/s", y="phase margin, deg")
    margin.set_ylim(0.0, 1.1 * max(phase))
    return sheet


def draw_gains(schedule: Schedule, ax: Axes) -> None:
    """Draw the gains against speed; rows that data do not support are hollow."""
    for name, colour in (("kp", canvas.SIMULATED), ("ki", canvas.SECOND), ("kd", canvas.THIRD)):
        values = np.array(schedule.column(name))
        if np.any(values):
            ax.plot(schedule.speeds, values, "-", color=colour, linewidth=1.4, label=name)
            _knots(schedule, values, colour, ax)
    canvas.dress(ax, y="gain", title=f"{schedule.axis.value}: gains per speed (hollow: not supported by data)")
    ax.legend(frameon=False, fontsize=9, ncols=3, loc="best")


def draw_forward(schedule: Schedule, ax: Axes) -> None:
    """Draw the feed-forward against speed, in degrees of fin."""
    values = np.degrees(np.array(schedule.column("feed_forward_rad")))
    ax.plot(schedule.speeds, values, "-", color=canvas.FOURTH, linewidth=1.4)
    _knots(schedule, values, canvas.FOURTH, ax)
    canvas.dress(ax, y="feed-forward, deg")


def draw_margins(checks: Sequence[Check], ax: Axes) -> None:
    """Draw the phase margin at the estimate and the least over the identified set."""
    speed = np.array([c.speed for c in checks])
    ax.plot(speed, [c.phase_deg for c in checks], "o-", color=canvas.SECOND, markersize=4, label="estimate")
    ax.plot(speed, [c.phase_least_deg for c in checks], "v--", color=canvas.SIMULATED, markersize=4, label="least over the set")
    canvas.dress(ax, x="speed, m/s", y="phase margin, deg")
    ax.set_ylim(bottom=0.0)
    ax.legend(frameon=False, fontsize=9, ncols=2, loc="lower right")


def draw_steps(steps: Sequence[tuple[float, Steps]], size: float, ax: Axes) -> None:
    """Draw the step at every speed, dark to light from slow to fast, with the 5 % corridor."""
    speeds = np.array([u for u, _ in steps])
    span = float(np.ptp(speeds)) or 1.0
    ax.axhspan(0.95 * np.degrees(size), 1.05 * np.degrees(size), color="0.92", linewidth=0)
    for i, (speed, shown) in enumerate(steps):
        share = (speed - float(speeds.min())) / span
        colour = (0.05 + 0.85 * share, 0.25 + 0.25 * share, 0.60 - 0.5 * share)
        label = f"{speed:.2f} m/s" if i in (0, len(steps) - 1) else None
        keep = shown.time <= SHOWN_S
        ax.plot(shown.time[keep], np.degrees(shown.angle[keep, 0]), color=colour, linewidth=1.2, label=label)
    canvas.dress(ax, y="angle, deg")
    ax.legend(frameon=False, fontsize=9, loc="lower right")


def _knots(schedule: Schedule, values: np.ndarray, colour: str, ax: Axes) -> None:
    for speed, value, supported in zip(schedule.speeds, values, schedule.column("supported"), strict=True):
        ax.plot([speed], [value], "o", color=colour, markerfacecolor=colour if supported else "white", markersize=6)
