"""Measured against simulated motion of one run: angle, rate, fin and residual over time, one panel each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.figures import canvas
from fieldsid.models.axis import Axis
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

SYMBOLS = {Axis.YAW: ("yaw", "yaw rate", "rudder"), Axis.PITCH: ("pitch", "pitch rate", "elevator")}


@dataclass(frozen=True, slots=True)
class MotionView:
    """What the panels show of one run.

    A record, the simulated angle and rate (n,) in rad and rad/s, the fin angle (n,) in rad
    after the actuator, and the noise of both sensors (rad, rad/s). `spans` are (start, end) s to be shaded.
    """

    record: Record
    angle: FloatArray
    rate: FloatArray
    fin: FloatArray
    noise_angle: float
    noise_rate: float
    spans: Sequence[tuple[float, float]] = ()

    @property
    def measured_angle(self) -> FloatArray:
        """The measured angle (n,) in deg, NaN where nothing was measured."""
        return np.degrees(np.where(self.record.angle_ok, self.record.angle, np.nan))

    @property
    def measured_rate(self) -> FloatArray:
        """The measured rate (n,) in deg/s, NaN where nothing was measured."""
        return np.degrees(np.where(self.record.rate_ok, self.record.rate, np.nan))


def draw(view: MotionView, axes: Sequence[Axes]) -> None:
    """Draw the four panels, top to bottom: angle, rate, fin, residual."""
    for channel in (0, 1):
        draw_channel(view, channel, axes[channel])
    canvas.legend_above(axes[0])
    draw_fin(view, axes[2])
    draw_residual(view, axes[3])
    for ax in axes:
        for start, end in view.spans:
            ax.axvspan(start, end, color=canvas.WARM, alpha=0.18, linewidth=0)
        ax.set_xlim(view.record.time[0], view.record.time[-1])
    for ax in axes[:-1]:
        ax.tick_params(labelbottom=False)
    axes[-1].set_xlabel("time, s")


def draw_channel(view: MotionView, channel: int, ax: Axes) -> None:
    """Draw a channel, 0 the angle in deg, 1 the rate in deg/s, measured and simulated."""
    unit, measured, simulated = (("deg", view.measured_angle, view.angle), ("deg/s", view.measured_rate, view.rate))[channel]
    canvas.dress(ax, y=f"{SYMBOLS[view.record.axis][channel]}, {unit}")
    canvas.dots(ax, view.record.time, measured)
    ax.plot(view.record.time, np.degrees(simulated), color=canvas.SIMULATED, linewidth=1.3, label="simulated")


def draw_fin(view: MotionView, ax: Axes) -> None:
    """Draw the logged fin in deg, and the fin angle that the model makes of it where the two differ."""
    record, logged = view.record, np.degrees(view.record.fin)
    canvas.dress(ax, y=f"{SYMBOLS[record.axis][2]}, deg")
    name = "measured fin" if record.fin_is_measured else "command"
    style = "steps-post" if record.fin_is_held else "default"
    ax.plot(record.time, logged, color="0.2", linewidth=1.1, drawstyle=style, label=name)
    if np.max(np.abs(view.fin[:-1] - record.fin[:-1])) > 1e-6:  # the last sample begins no interval
        ax.plot(record.time, np.degrees(view.fin), color=canvas.SECOND, linewidth=1.1, label="fin in the model")
    canvas.legend_above(ax)


def draw_residual(view: MotionView, ax: Axes) -> None:
    """Draw measured less simulated over the sensor's noise, angle and rate, with the 99 % band of the noise."""
    time = view.record.time
    canvas.dress(ax, y="residual / noise")
    parts = (
        ("angle", view.measured_angle - np.degrees(view.angle), view.noise_angle, canvas.THIRD),
        ("rate", view.measured_rate - np.degrees(view.rate), view.noise_rate, canvas.SECOND),
    )
    for name, residual, noise, colour in parts:
        if np.isfinite(residual).any() and noise > 0:
            ax.plot(time, residual / np.degrees(noise), color=colour, linewidth=0.7, label=name, alpha=0.6)
    canvas.band(ax, canvas.TWO_SIDED_99, "99 % of the noise")
    canvas.legend_above(ax)


def panels(view: MotionView, title: str, facts: str = "") -> Figure:
    """Return a sheet with the four panels, a title and a line of facts under it."""
    figure = canvas.sheet(9.0, 8.2, title + (f"\n{facts}" if facts else ""))
    axes = figure.subplots(4, 1, sharex=True, height_ratios=(1.25, 1.25, 0.9, 1.0))
    draw(view, list(axes))
    figure.align_ylabels(list(axes))
    return figure
