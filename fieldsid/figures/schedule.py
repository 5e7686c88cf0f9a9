"""A schedule: gains and feed-forward over speed, margins with the least over the identified set, and steps at every speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.figures import canvas
from fieldsid.schedule.flown.response import Steps
from fieldsid.schedule.record import Schedule
from fieldsid.schedule.verify import STEPS_RAD, Check, Verification

SHOWN_S = 25.0


def figure(schedule: Schedule, verification: Verification) -> Figure:
    """Return gains, feed-forward and margins over speed at the left, steps of schedule and constant gain at the right."""
    sheet = canvas.sheet(12.0, 9.0)
    left, right = np.asarray(sheet.subfigures(1, 2, width_ratios=(1.0, 1.15)), dtype=object)
    gains, forward, margins = np.ravel(left.subplots(3, 1, sharex=True))
    draw_gains(schedule, gains)
    draw_forward(schedule, forward)
    draw_margins(verification.scheduled, margins)
    *steps, leg = np.ravel(right.subplots(4, 1))
    for at, (size, ax) in enumerate(zip(STEPS_RAD[schedule.axis], steps, strict=True)):
        draw_steps([(f.speed, f.scheduled[at], f.constant[at]) for f in verification.flown], size, ax)
    steps[0].set_title(
        f"steps with the {schedule.kind} schedule; thin: one constant gain, kp = {verification.constant_row.gains.kp:.3g}",
        loc="left", fontsize=10,
    )  # fmt: skip
    draw_leg([(f.speed, f.leg) for f in verification.flown], verification.disturbance, leg)
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


def draw_steps(steps: Sequence[tuple[float, Steps, Steps]], size: float, ax: Axes) -> None:
    """Draw a step at every speed, dark to light from slow to fast, with the 5 % corridor; thin with one constant gain."""
    ax.axhspan(0.95 * np.degrees(size), 1.05 * np.degrees(size), color="0.92", linewidth=0)
    for (speed, own, constant), colour in zip(steps, _colours([u for u, _, _ in steps]), strict=True):
        label = f"{speed:.2f} m/s" if speed in (steps[0][0], steps[-1][0]) else None
        for shown, width in ((constant, 0.5), (own, 1.4)):
            keep = shown.time <= SHOWN_S
            angle = np.degrees(shown.angle[keep, 0])
            ax.plot(shown.time[keep], angle, color=colour, linewidth=width, label=label if width > 1 else None)
    ax.set_ylim(-0.1 * np.degrees(size), 1.4 * np.degrees(size))
    canvas.dress(ax, y=f"{np.degrees(size):.0f}° step, deg")
    ax.legend(frameon=False, fontsize=9, loc="lower right")


def draw_leg(legs: Sequence[tuple[float, Steps]], disturbance: float, ax: Axes) -> None:
    """Draw the angle of a straight leg at every speed, in the disturbance the models' runs had."""
    for (_, shown), colour in zip(legs, _colours([u for u, _ in legs]), strict=True):
        keep = shown.time <= SHOWN_S
        ax.plot(shown.time[keep], np.degrees(shown.angle[keep, 0]), color=colour, linewidth=1.0)
    canvas.dress(ax, x="time, s", y="straight leg, deg")
    said = f"disturbance moment {disturbance:.2g} rad/s² rms" if disturbance > 0 else "no disturbance is known"
    ax.set_title(said, loc="left", fontsize=9)


def _colours(speeds: Sequence[float]) -> list[tuple[float, float, float]]:
    span = float(np.ptp(speeds)) or 1.0
    shares = [(speed - min(speeds)) / span for speed in speeds]
    return [(0.05 + 0.85 * s, 0.25 + 0.25 * s, 0.60 - 0.5 * s) for s in shares]


def _knots(schedule: Schedule, values: np.ndarray, colour: str, ax: Axes) -> None:
    for speed, value, supported in zip(schedule.speeds, values, schedule.column("supported"), strict=True):
        ax.plot([speed], [value], "o", color=colour, markerfacecolor=colour if supported else "white", markersize=6)
