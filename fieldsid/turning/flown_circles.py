"""Measured circles for a prediction: found in their runs, compared with it, and put in place of its radius."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from fieldsid.errors import DataError
from fieldsid.logs.run import Note, Run
from fieldsid.logs.several.sifting import Refused, attempt, sifted
from fieldsid.models.axis import NAMES, Axis
from fieldsid.planning.safety.envelope import LEAST_FIN
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.rounding import TWO_SIDED_95
from fieldsid.turning.measured.circle import LEAST_TURN_FOR_CURRENT_RAD
from fieldsid.turning.measured.measured_turn import MeasuredTurn, measure_turn
from fieldsid.turning.prediction import MeasuredRow, TurnRow

REPEATED_SD = 0.005
"""Relative standard deviation of a circle from flight to flight: hulls of the ensemble (seed 1), at the same speed and rudder and
with a disturbance moment of a hundredth of the rudder's, were 0.1 to 0.3 % off the truth."""


def circles_of(measured: Sequence[Run], unfit: Refused[Run] | None, *, needed: bool) -> tuple[list[MeasuredTurn], list[Note]]:
    """Return the circles of measured runs, and a note where no run has a circle; raises DataError there if one is `needed`."""
    try:
        return [turn for _, turn in sifted(measured, (attempt(measure_turn, run) for run in measured), unfit)], []
    except DataError as error:
        if needed:
            raise
        names = ", ".join(run.name for run in measured)
        words = f"{error.what}: {names} shapes the prediction, but there is no circle to compare it with"
        return [], [Note("no_circle", words, {"runs": [run.name for run in measured]})]


def against_rudder(turn: MeasuredTurn, source: ParameterSource) -> bool:
    """Return whether a vehicle circled to the other side than its rudder turns it, as an unstable hull may."""
    to_starboard = float(np.sign(source.base_at(float(source.speeds[0]))[NAMES[Axis.YAW].authority])) * turn.fin
    is_known = bool(np.isfinite(to_starboard))
    return is_known and abs(turn.fin) > LEAST_FIN and (to_starboard > 0.0) != (turn.side == "starboard")


def against_rudder_note(turn: MeasuredTurn) -> Note:
    """Return the note on a circle to the other side than its rudder."""
    words = f"{turn.run} turned to {turn.side} with a rudder of {turn.fin:.3g} rad to the other side: it is not compared"
    return Note("turned_against_rudder", words, {"runs": [turn.run]})


def compared_with(
    turn: MeasuredTurn, rows_at: Callable[[Sequence[float], float], list[TurnRow]], least: Callable[[float], float]
) -> MeasuredRow:
    """Return a measured turn with its prediction; the prediction is NaN where the fin is below `least` (rad) of its speed."""
    if not (np.isfinite(turn.fin) and abs(turn.fin) > max(LEAST_FIN, least(turn.flown_at))):
        nan = float("nan")
        return MeasuredRow(turn, nan, (nan, nan))
    row = next(r for r in rows_at([turn.flown_at], abs(turn.fin)) if r.side == turn.side)
    return MeasuredRow(turn, row.radius, row.interval95)


def with_measurement(row: TurnRow, measured: Sequence[MeasuredRow], rudder: float) -> TurnRow:
    """Return the row with the measured radius where a circle was flown at this speed, side and rudder.

    A shorter turn does not replace a row of the model fitted to all runs: its current cannot be estimated, and that model has the
    turn among its runs.
    """
    for m in measured:
        is_usable = row.method != "maneuvering" or abs(m.turn.circle.turned) >= LEAST_TURN_FOR_CURRENT_RAD
        if is_usable and m.has_entry(row.speed, row.side) and m.has_rudder(rudder):
            return replace(
                row,
                radius=m.turn.circle.radius,
                interval95=_repeatable(m.turn),
                method="measured",
                trust="measured",
                because=(),
                settle_with=f"settled by `{m.turn.run}`",
            )
    return row


def _repeatable(turn: MeasuredTurn) -> tuple[float, float]:
    """Return the 95 % interval of the radius in another flight, the variation of the water from flight to flight included."""
    low, high = turn.circle.interval95
    middle = turn.circle.radius
    half = float(np.hypot(0.5 * (high - low), TWO_SIDED_95 * REPEATED_SD * middle))
    return middle - half, middle + half
