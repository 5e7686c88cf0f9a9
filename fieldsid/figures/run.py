"""A run: angles, rates, fins and the rest of its signals over time, one panel for each kind."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.errors import DataError
from fieldsid.figures import canvas
from fieldsid.logs.run import Run

PANELS = (
    ("fin, deg", ("rudder_rad", "rudder_measured_rad", "elevator_rad", "elevator_measured_rad")),
    ("angle, deg", ("yaw_rad", "pitch_rad", "roll_rad")),
    ("rate, deg/s", ("yaw_rate_rad_s", "pitch_rate_rad_s", "roll_rate_rad_s")),
    ("speed, m/s", ("surge_m_s", "sway_m_s", "heave_m_s")),
    ("depth, m", ("depth_m",)),
    ("position, m", ("x_m", "y_m")),
    ("thrust", ("thrust", "thrust_ratio")),
    ("propeller, 1/min", ("propeller_rpm",)),
)
"""The signals that share a panel; where its unit is degrees the signals are in rad."""


def figure(run: Run) -> Figure:
    """Return a sheet with a panel for each kind of signal that was measured; raises DataError where none was."""
    shown = [(y, present) for y, names in PANELS if (present := [n for n in names if run.has(n)])]
    if not shown:
        raise DataError(f"run {run.name!r} has nothing to draw", found=", ".join(run.signals) or "no signals")
    sheet = canvas.sheet(9.0, 1.0 + 1.7 * len(shown), _title(run))
    axes = sheet.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    for (y, names), ax in zip(shown, axes, strict=True):
        draw(run, names, y, ax)
    axes[-1].set_xlabel("time, s")
    sheet.align_ylabels(list(axes))
    return sheet


def _title(run: Run) -> str:
    speed = f", {np.nanmedian(run['surge_m_s']):.2f} m/s" if run.has("surge_m_s") else ""
    return f"{run.name}: {run.time[-1] - run.time[0]:.1f} s, {len(run)} samples{speed}"


def draw(run: Run, names: list[str], y: str, ax: Axes) -> None:
    """Draw signals of one kind over time: a command in steps, all else from sample to sample."""
    canvas.dress(ax, y=y)
    for i, name in enumerate(names):
        values = np.degrees(run[name]) if "deg" in y else run[name]
        style = "steps-post" if name in ("rudder_rad", "elevator_rad") else "default"
        ax.plot(
            run.time, values, color=canvas.SERIES[i], linewidth=1.1, drawstyle=style, label=name.rpartition("_rad")[0] or name
        )
    canvas.legend_above(ax)
