"""Turning: radius and u-turn time over speed with bands and measured points, and a track with its circle."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.figures import canvas
from fieldsid.rounding import TWO_SIDED_95
from fieldsid.turning.measured.measured_turn import MeasuredTurn
from fieldsid.turning.prediction import SIDES, TurnPrediction, TurnRow

COLOURS = {"port": canvas.SIMULATED, "starboard": canvas.SECOND}
SHIFT = 0.004
"""Shift of a side where there are few speeds, as a share of the speed, so that the error bars of the sides do not overlap."""
FEW = 12
LEAST_HALF_SPAN = 0.1
"""Smallest half width of the speed axis, as a share of the speed: at a single speed the shift is not to look like another one."""


def figure(prediction: TurnPrediction) -> Figure:
    """Return radius and u-turn time over the entry speed, one above the other."""
    sheet = canvas.sheet(9.0, 7.5)
    top, bottom = np.ravel(sheet.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0)))
    draw_radius(prediction, top)
    draw_time(prediction, bottom)
    low, high = bottom.get_xlim()
    middle = 0.5 * (low + high)
    half = max(0.5 * (high - low), LEAST_HALF_SPAN * middle)
    bottom.set_xlim(middle - half, middle + half)
    bottom.set_xlabel("speed before the turn, m/s")
    return sheet


def draw_radius(prediction: TurnPrediction, ax: Axes) -> None:
    """Draw the radius of both sides with its band, and the measured circles with theirs."""
    for side in SIDES:
        rows = [r for r in prediction.rows if r.side == side]
        if rows:
            _series(ax, rows, [r.predicted for r in rows], [r.predicted95 for r in rows], f"{side}, predicted", side)
    for m in prediction.measured:
        circle, side = m.turn.circle, m.turn.side
        speed = m.turn.flown_at
        label = f"measured circle, {side}" if m is next(x for x in prediction.measured if x.turn.side == side) else None
        ax.errorbar(
            [speed], [circle.radius], yerr=[TWO_SIDED_95 * circle.radius_std_error], fmt="D", color=COLOURS[side],
            markeredgecolor="0.1", markersize=7, zorder=6, label=label,
        )  # fmt: skip
        if np.isfinite(m.predicted) and abs(abs(m.turn.fin) - prediction.rudder_max) > 0.05 * prediction.rudder_max:
            words = f"{np.degrees(abs(m.turn.fin)):.0f}°: predicted {m.predicted:.2f} m"
            ax.annotate(words, (speed, circle.radius), textcoords="offset points", xytext=(8, 6), fontsize=8)
    canvas.dress(ax, y="radius, m", title=f"{_tightest(prediction)}\n{_band(prediction)}")
    ax.set_ylim(bottom=0.0)
    ax.legend(frameon=False, fontsize=9, loc="best")


def _tightest(prediction: TurnPrediction) -> str:
    row = min(prediction.rows, key=lambda r: r.radius)
    rudder = f"{np.degrees(prediction.rudder_max):.0f}° of rudder"
    radius = f"{row.radius:.2f} m" if not row.band_only else "between {:.2f} and {:.2f} m".format(*row.interval95)
    return f"with {rudder} the tightest turn is {radius} to {row.side} at {row.speed:.2f} m/s, {row.trust}"


def _band(prediction: TurnPrediction) -> str:
    """Return the meaning of the bars or bands in words."""
    drawn = "bars" if len({r.speed for r in prediction.rows}) <= FEW else "bands"
    trust = {r.trust for r in prediction.rows}
    wider = ", with the error of the model's form where nothing was measured" if trust != {"measured"} else ""
    return f"{drawn}: 95 % of what the runs allow{wider}"


def draw_time(prediction: TurnPrediction, ax: Axes) -> None:
    """Draw the time of a u-turn of both sides with its band."""
    for side in SIDES:
        rows = [r for r in prediction.rows if r.side == side]
        _series(ax, rows, [r.u_turn_time for r in rows], [r.u_turn_time95 for r in rows], side, side)
    canvas.dress(ax, y="time to turn 180°, s")
    ax.set_ylim(bottom=0.0)


def track_figure(turn: MeasuredTurn) -> Figure:
    """Return the track of a measured turn with its circle, and the distance of the settled part to it."""
    sheet = canvas.sheet(7.5, 8.0)
    top, bottom = np.ravel(sheet.subplots(2, 1, height_ratios=(3.2, 1.0)))
    draw_track(turn, top)
    span = np.linspace(turn.start_s, turn.end_s, turn.circle.residual.size)
    bottom.plot(span, turn.circle.residual, ".", markersize=2.5, color=canvas.MEASURED)
    bottom.axhline(0.0, color=canvas.SIMULATED, linewidth=1.0)
    canvas.dress(bottom, x="time, s", y="off the circle, m")
    return sheet


def draw_track(turn: MeasuredTurn, ax: Axes) -> None:
    """Draw x north up against y east right: whole track, settled part with the current taken out, fitted circle."""
    x, y = turn.track
    circle = turn.circle
    ax.plot(y, x, color=canvas.QUIET, linewidth=1.0, label="track")
    sx, sy = turn.settled
    ax.plot(
        sy, sx, ".", markersize=2.5, color="0.35", label="settled part" + (", current removed" if any(circle.current) else "")
    )
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    north, east = circle.centre
    speed = float(np.hypot(*circle.current))
    ax.plot(
        east + circle.radius * np.sin(angle), north + circle.radius * np.cos(angle), color=canvas.SIMULATED, linewidth=1.6,
        label=f"circle R = {circle.radius:.3f} ± {circle.radius_std_error:.3f} m\nin a current of {speed:.3f} m/s",
    )  # fmt: skip
    ax.plot([east], [north], "+", color=canvas.SIMULATED, markersize=10)
    canvas.dress(
        ax,
        x="east y, m",
        y="north x, m",
        title=f"{turn.run}: {turn.side} at {turn.flown_at:.2f} m/s, radius {circle.radius:.2f} m",
    )
    ax.set_aspect("equal", adjustable="box")
    reach = 2.2 * circle.radius
    ax.set_xlim(east - reach, east + reach)
    ax.set_ylim(north - reach, north + reach)
    ax.legend(frameon=False, fontsize=9, loc="upper right")


def _series(ax: Axes, rows: list[TurnRow], values: list[float], bands: list[tuple[float, float]], label: str, side: str) -> None:
    if not rows:
        return
    speed = np.array([r.speed for r in rows])
    low, high = np.array([b[0] for b in bands]), np.array([b[1] for b in bands])
    if speed.size <= FEW:
        x = speed * (1.0 + SHIFT * SIDES[side])
        off = np.maximum(np.stack([np.array(values) - low, high - np.array(values)]), 0.0)
        ax.errorbar(x, values, yerr=off, fmt="o-", color=COLOURS[side], capsize=3, markersize=4, linewidth=1.2, label=label)
        return
    ax.plot(speed, values, color=COLOURS[side], linewidth=1.5, label=label, linestyle="-" if side == "port" else "--")
    ax.fill_between(speed, low, high, color=COLOURS[side], alpha=0.14, linewidth=0)
