"""The turn at one speed to one side, in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fieldsid.rounding import number
from fieldsid.views._row import row_view

if TYPE_CHECKING:
    from fieldsid.turning.prediction import TurnRow


def line(row: TurnRow) -> str:
    """Return speed, side, radius with its interval, the time of a u-turn, and what the row rests on."""
    low, high = (number(v, 3) for v in row.interval95)
    radius = f"radius between {low} and {high} m" if row.band_only else f"radius {number(row.radius, 3)} m ({low} .. {high})"
    return f"{row.speed:.2f} m/s, {row.side}: {radius}, u-turn in {number(row.u_turn_time, 3)} s, {row.method}, {row.trust}"


VIEW = row_view("turn_row", line)
