"""A schedule: gains, feed-forward and margins over speed with the requirements; steps, their fin, a straight leg."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.figures import canvas
from fieldsid.schedule.check import Check
from fieldsid.schedule.flown.response import Steps
from fieldsid.schedule.record import Schedule
from fieldsid.schedule.search.objective import DRAWS_MARGIN_SHARE
from fieldsid.schedule.verify import Verification, steps_of

SHOWN_SHARE = 25.0 / 60.0
"""Share of a flight that is shown: a satisfactory step has settled by then."""
LEAST_SCALE_DEG = 1.0
"""Least range of the feed-forward scale in deg, as the neutral position of a fin is not set more accurately."""
LEAST_LEG_DEG = 0.5
STOP_SHARE = 0.999


def figure(schedule: Schedule, verification: Verification) -> Figure:
    """Return gains, feed-forward, margins and a leg in the disturbance, if any, at the left; steps and fin at the right."""
    sheet = canvas.sheet(12.0, 11.0)
    left, right = np.asarray(sheet.subfigures(1, 2, width_ratios=(1.0, 1.15)), dtype=object)
    disturbance = verification.disturbance
    gains, forward, margins, *leg = np.ravel(left.subplots(3 + (disturbance > 0), 1))
    draw_gains(schedule, gains)
    draw_forward(schedule, forward)
    draw_margins(schedule, verification.scheduled, margins)
    for ax in leg:
        draw_leg([(f.speed, f.leg) for f in verification.flown], disturbance, ax)
    *steps, fin = np.ravel(right.subplots(4, 1))
    until = SHOWN_SHARE * max(f.pace.flight for f in verification.flown)
    for at, (size, ax) in enumerate(zip(steps_of(schedule), steps, strict=True)):
        draw_steps([(f.speed, f.scheduled[at], f.constant[at]) for f in verification.flown], size, until, ax)
    steps[0].set_title(
        f"{schedule.kind}, steps to the later side; thin: one constant gain, kp = {verification.constant_row.gains.kp:.3g}",
        loc="left", fontsize=10,
    )  # fmt: skip
    draw_fin(schedule, [(f.speed, f.scheduled[1], f.scheduled[2]) for f in verification.flown], until, fin)
    return sheet


def gains_figure(schedule: Schedule) -> Figure:
    """Return gains, feed-forward and the phase margin of the draws over speed, one above the other."""
    sheet = canvas.sheet(8.0, 8.0)
    gains, forward, margin = np.ravel(sheet.subplots(3, 1, sharex=True))
    draw_gains(schedule, gains)
    draw_forward(schedule, forward)
    phase = schedule.column("phase_margin_deg")
    margin.plot(schedule.speeds, phase, "o-", color=canvas.SECOND, markersize=4, label="least over the draws")
    _draw_required_margins(schedule, margin)
    canvas.dress(margin, x="speed, m/s", y="phase margin, deg")
    margin.set_ylim(min(0.0, 1.1 * min(phase)), max(1.1 * max(phase), 1.3 * schedule.phase_margin_deg))
    margin.legend(frameon=False, fontsize=9, ncols=3, loc="lower right")
    return sheet


def draw_gains(schedule: Schedule, ax: Axes) -> None:
    """Draw the gains against speed; rows that data do not support are hollow."""
    for name, colour in (("kp", canvas.SIMULATED), ("ki", canvas.SECOND), ("kd", canvas.THIRD)):
        values = np.array(schedule.column(name))
        if np.any(values):
            ax.plot(schedule.speeds, values, "-", color=colour, linewidth=1.4, label=name)
            _knots(schedule, values, colour, ax)
    ax.axhline(0.0, color=canvas.QUIET, linewidth=0.8)
    canvas.dress(ax, y="gain", title=f"{schedule.axis.value}: gains per speed (hollow: not supported by data)")
    ax.legend(frameon=False, fontsize=9, ncols=3, loc="best")


def draw_forward(schedule: Schedule, ax: Axes) -> None:
    """Draw the feed-forward against speed, in degrees of fin, on a scale no finer than the accuracy of a fin."""
    values = np.degrees(np.array(schedule.column("feed_forward_rad")))
    ax.plot(schedule.speeds, values, "-", color=canvas.FOURTH, linewidth=1.4)
    _knots(schedule, values, canvas.FOURTH, ax)
    ax.axhline(0.0, color=canvas.QUIET, linewidth=0.8)
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    spare = 0.15 * (high - low)
    ax.set_ylim(min(low - spare, -LEAST_SCALE_DEG), max(high + spare, LEAST_SCALE_DEG))
    canvas.dress(ax, y="feed-forward, deg")


def draw_margins(schedule: Schedule, checks: Sequence[Check], ax: Axes) -> None:
    """Draw the phase margin at the estimate and the least over the identified set, with the required margins."""
    speed = np.array([c.speed for c in checks])
    ax.plot(speed, [c.phase_deg for c in checks], "o-", color=canvas.SECOND, markersize=4, label="estimate")
    ax.plot(speed, [c.phase_least_deg for c in checks], "v--", color=canvas.SIMULATED, markersize=4, label="least over the set")
    _draw_required_margins(schedule, ax)
    canvas.dress(ax, x="speed, m/s", y="phase margin, deg")
    ax.set_ylim(bottom=min(0.0, 1.1 * min(c.phase_least_deg for c in checks)))
    ax.legend(frameon=False, fontsize=8, ncols=4, loc="lower right", columnspacing=1.0, handlelength=1.6)


def _draw_required_margins(schedule: Schedule, ax: Axes) -> None:
    """Draw the margin required at the estimate, and that required over the draws."""
    ax.axhline(schedule.phase_margin_deg, color="0.3", linewidth=1.0, linestyle="-.", label="asked")
    of_draws = DRAWS_MARGIN_SHARE * schedule.phase_margin_deg
    ax.axhline(of_draws, color="0.3", linewidth=1.0, linestyle=":", label="of 95 % of the draws")


def draw_fin(schedule: Schedule, steps: Sequence[tuple[float, Steps, Steps]], until: float, ax: Axes) -> None:
    """Draw the fin in the standard step, thin in the large one, for `until` s, with its limits and how long it is at them."""
    limit = max(schedule.column("fin_limit_rad"))
    for (_, usual, large), colour in zip(steps, _colours([u for u, _, _ in steps]), strict=True):
        for shown, width in ((large, 0.6), (usual, 1.4)):
            keep = shown.time <= until
            ax.plot(shown.time[keep], np.degrees(shown.fin[keep, 0]), color=colour, linewidth=width)
    for sign in (-1.0, 1.0):
        ax.axhline(sign * np.degrees(limit), color="0.3", linewidth=1.0, linestyle="-.")
    at_stop = max(float(np.mean(np.abs(large.fin[:, 0]) >= STOP_SHARE * limit)) * float(large.time[-1]) for _, _, large in steps)
    usual, large = (np.degrees(steps_of(schedule)[i]) for i in (1, 2))
    ax.set_title(
        f"fin in the {usual:.0f}° step, thin in the {large:.0f}° step: at its limit for up to {at_stop:.1f} s",
        loc="left",
        fontsize=9,
    )
    canvas.dress(ax, x="time, s", y="fin, deg")


def draw_steps(steps: Sequence[tuple[float, Steps, Steps]], size: float, until: float, ax: Axes) -> None:
    """Draw a step at every speed, dark to light from slow to fast, with the 5 % corridor; thin with one constant gain."""
    ax.axhspan(0.95 * np.degrees(size), 1.05 * np.degrees(size), color="0.92", linewidth=0)
    for (speed, own, constant), colour in zip(steps, _colours([u for u, _, _ in steps]), strict=True):
        label = f"{speed:.2f} m/s" if speed in (steps[0][0], steps[-1][0]) else None
        for shown, width in ((constant, 0.5), (own, 1.4)):
            keep = shown.time <= until
            angle = np.degrees(shown.angle[keep, 0])
            ax.plot(shown.time[keep], angle, color=colour, linewidth=width, label=label if width > 1 else None)
    ax.set_ylim(-0.1 * np.degrees(size), 1.4 * np.degrees(size))
    canvas.dress(ax, y=f"{np.degrees(size):.0f}° step, deg")
    ax.legend(frameon=False, fontsize=9, loc="lower right")


def draw_leg(legs: Sequence[tuple[float, Steps]], disturbance: float, ax: Axes) -> None:
    """Draw the angle of a straight leg at every speed, in the disturbance the models' runs had."""
    most = 0.0
    for (_, shown), colour in zip(legs, _colours([u for u, _ in legs]), strict=True):
        angle = np.degrees(shown.angle[:, 0])
        ax.plot(shown.time, angle, color=colour, linewidth=0.8)
        most = max(most, float(np.abs(angle).max()))
    ax.set_ylim(-max(1.1 * most, LEAST_LEG_DEG), max(1.1 * most, LEAST_LEG_DEG))
    canvas.dress(ax, x="time, s", y="straight leg, deg")
    ax.set_title(f"straight leg in a disturbance as the runs had, up to {disturbance:.2g} rad/s² rms", loc="left", fontsize=9)


def _colours(speeds: Sequence[float]) -> list[tuple[float, float, float]]:
    span = float(np.ptp(speeds)) or 1.0
    shares = [(speed - min(speeds)) / span for speed in speeds]
    return [(0.05 + 0.85 * s, 0.25 + 0.25 * s, 0.60 - 0.5 * s) for s in shares]


def _knots(schedule: Schedule, values: np.ndarray, colour: str, ax: Axes) -> None:
    for speed, value, supported in zip(schedule.speeds, values, schedule.column("supported"), strict=True):
        ax.plot([speed], [value], "o", color=colour, markerfacecolor=colour if supported else "white", markersize=6)
