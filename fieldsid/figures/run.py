"""A run: angles, rates, fins and the rest of its signals over time, one panel for each kind."""

from __future__ import annotations

import numpy as np

from fieldsid.errors import DataError
from fieldsid.figures.panel import Panel, Picture, Series
from fieldsid.figures.several import KINDS
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


def figure(run: Run, title: str) -> Picture:
    """Return a panel for each kind of signal that was measured; raises DataError where none was."""
    shown = [(y, present) for y, names in PANELS if (present := [n for n in names if run.has(n)])]
    if not shown:
        raise DataError(f"run {run.name!r} has nothing to draw", found=", ".join(run.signals) or "no signals")
    panels = [panel(run, names, y, "time, s" if y == shown[-1][0] else "") for y, names in shown]
    return Picture(title, (9.0, 1.0 + 1.7 * len(shown)), (panels,))


def panel(run: Run, names: list[str], y: str, x: str) -> Panel:
    """Return signals of one kind over time: a command in steps, all else from sample to sample."""
    series = [
        Series(
            run.time,
            np.degrees(run[name]) if "deg" in y else run[name],
            kind,
            name.rpartition("_rad")[0] or name,
            "steps" if name in ("rudder_rad", "elevator_rad") else "line",
        )
        for name, kind in zip(names, KINDS, strict=False)
    ]
    return Panel(y, series, x=x)
