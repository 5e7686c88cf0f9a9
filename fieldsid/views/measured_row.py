"""A measured circle and its prediction, in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fieldsid.page import cut
from fieldsid.rounding import number, with_error
from fieldsid.views._row import row_view

if TYPE_CHECKING:
    from fieldsid.turning.prediction import MeasuredRow


def line(row: MeasuredRow) -> str:
    """Return run, side, the radius measured and the one predicted."""
    circle, (low, high) = row.turn.circle, row.predicted95
    measured = with_error(circle.radius, circle.radius_std_error)
    predicted = f"{number(row.predicted, 3)} m ({number(low, 3)} .. {number(high, 3)})"
    return f"{cut(row.turn.run, 60)}, {row.turn.side}: measured {measured} m, predicted {predicted}"


VIEW = row_view("measured_row", line)
