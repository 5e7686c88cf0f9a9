"""The gains at one speed, in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fieldsid.rounding import number
from fieldsid.views._row import row_view

if TYPE_CHECKING:
    from fieldsid.schedule.record import Row


def line(row: Row) -> str:
    """Return speed, gains, feed-forward, phase margin and whether data support the row."""
    gains = ", ".join(
        f"{name} = {number(value)}"
        for name, value in (("kp", row.gains.kp), ("ki", row.gains.ki), ("kd", row.gains.kd))
        if value != 0.0 or name == "kp"
    )
    margin = f"phase margin {row.phase_margin_deg:.0f} deg, {'supported' if row.supported else 'not supported'} by data"
    return f"{row.speed:.2f} m/s: {gains}, feed-forward {number(row.feed_forward, 3)} rad, {margin}"


VIEW = row_view("row", line)
