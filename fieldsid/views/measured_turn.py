"""A measured circle: its radius with error, the speed and fin of the turn, and the track."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import cut
from fieldsid.records.keys import body_of
from fieldsid.rounding import number, with_error
from fieldsid.views import row
from fieldsid.views._words import table

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.turning.measured.measured_turn import MeasuredTurn


def line(turn: MeasuredTurn) -> str:
    """Return run, side, radius, fin and speed."""
    circle = turn.circle
    radius = f"radius {with_error(circle.radius, circle.radius_std_error)} m"
    return f"{cut(turn.run, 60)}, {turn.side}: {radius}, fin {number(turn.fin, 3)} rad, {turn.path_speed:.2f} m/s along the path"


def frames(turn: MeasuredTurn) -> Frames:
    """Return the circle in one row, and the track."""
    return {"circle": lambda: table([body_of(turn)], "run"), "track": lambda: _track(turn)}


def _track(turn: MeasuredTurn) -> DataFrame:
    import pandas as pd

    x, y = turn.track
    return pd.DataFrame({"x_m": x, "y_m": y})


def figures(turn: MeasuredTurn) -> Figures:
    """Return the track with its circle."""
    return {"track": sketch("turn", turn, draw="track_figure")}


VIEW = View("measured_turn", line, row.page, frames, lambda turn: turn.run, figures)
