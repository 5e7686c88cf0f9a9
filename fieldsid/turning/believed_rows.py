"""The rows of a prediction that rests on all runs together, and why one of them is not taken as identified."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.errors import ModelError
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.turning.maneuvering.belief import Belief, BelievedTurn
from fieldsid.turning.model_error import MIN_COVERED_SHARE
from fieldsid.turning.prediction import MAX_KNOWN_WIDTH, SIDES, TurnRow, is_band_only, predicted_row
from fieldsid.turning.steady.speed_loss import SurgeModel
from fieldsid.turning.steady.steady_turn import blended_radius

LEAST_EFFECTIVE = 10.0
"""Independent draws: with fewer the median is off by more than 0.4 of the spread, and the spread itself by more than a fifth."""
MAX_UNSETTLED = 0.05
"""Share of the draws without a settled turn above which a turn is not taken as identified."""


def believed_rows(
    source: ParameterSource, belief: Belief, speeds: Sequence[float], rudder: float, surge: SurgeModel | None
) -> list[TurnRow]:
    """Return the rows of a belief at speeds (m/s) to both sides, the identified models' own circle beside each.

    Raises ModelError where nothing that the runs allow has a settled turn.
    """
    own = blended_radius(source, np.array(speeds, dtype=np.float64), rudder, surge)
    return [
        _believed_row(source, belief, belief.turn(float(speed), rudder, sign), float(own[side][i]), float(speed), side, rudder)
        for side, sign in SIDES.items()
        for i, speed in enumerate(speeds)
    ]


def _believed_row(
    source: ParameterSource, belief: Belief, turn: BelievedTurn, of_model: float, speed: float, side: str, rudder: float
) -> TurnRow:
    if not np.isfinite(turn.radius):
        raise ModelError(
            f"no draw that the runs allow has a settled turn to {side} at {speed:.3g} m/s",
            found=f"rudder {rudder:.3g} rad",
            hint="fly a turning circle there, and give it with `--measured`",
        )
    because = _missing(turn, flown=source.supports(speed), usual=belief.fitted.is_usual)
    time = float(turn.transient.time_180[0])
    low, high = turn.interval95
    return predicted_row(
        speed,
        side,
        rudder,
        because,
        radius=turn.radius,
        interval95=turn.interval95,
        steady_radius=turn.radius,
        u_turn_time=time,
        yaw_rate_max=turn.rate,
        method="maneuvering",
        turn_speed=turn.path_speed,
        u_turn_time95=(time * low / turn.radius, time * high / turn.radius),
        of_model=of_model,
        **turn.transient.of(0),
    )


def _missing(turn: BelievedTurn, *, flown: bool, usual: bool) -> tuple[str, ...]:
    """Return why a turn is not taken as identified; empty where the runs reached it and its band is narrow."""
    short = {
        "a turn this tight was not flown": turn.curvature_covered >= MIN_COVERED_SHARE,
        "a fin angle this large was not flown": turn.fin_covered >= MIN_COVERED_SHARE,
        "this speed was not flown": flown,
        "the draws are too much alike to tell how wide the band is": turn.effective >= LEAST_EFFECTIVE,
        "the fit lies where no vehicle of the ensemble does": usual,
    }
    return (*(says for says, fine in short.items() if not fine), *doubts_of_draws(turn.radius, turn.interval95, turn.unsettled))


def doubts_of_draws(radius: float, band: tuple[float, float], unsettled: float) -> tuple[str, ...]:
    """Return what the draws say against taking a turn as identified: a wide band (m, m), or draws that never settle."""
    doubts = {
        f"the band is wider than {MAX_KNOWN_WIDTH:.0%} of the radius": not is_band_only(radius, band),
        f"{unsettled:.0%} of what the runs allow has no settled turn there": unsettled <= MAX_UNSETTLED,
    }
    return tuple(says for says, fine in doubts.items() if not fine)
