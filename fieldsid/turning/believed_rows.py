"""The rows of a prediction from the model fitted to all runs, and the reasons why a row does not count as identified."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.errors import ModelError
from fieldsid.plant.laws.regression import CONFIDENCE_LEVEL
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.turning.maneuvering.belief import Belief, BelievedTurn
from fieldsid.turning.model_error import MIN_COVERED_SHARE
from fieldsid.turning.prediction import MAX_KNOWN_WIDTH, SIDES, TurnRow, is_band_only, predicted_row
from fieldsid.turning.steady.speed_loss import SurgeModel
from fieldsid.turning.steady.steady_turn import blended_radius

LEAST_EFFECTIVE = 10.0
"""Effective draws: with fewer the error of the median is above 0.4 standard deviations and that of the spread above a fifth."""
MAX_UNSETTLED = 1.0 - CONFIDENCE_LEVEL
"""Share of draws without a settled turn above which a turn does not count as identified."""


def believed_rows(
    source: ParameterSource, belief: Belief, speeds: Sequence[float], rudder: float, surge: SurgeModel | None
) -> list[TurnRow]:
    """Return the rows of a posterior's turns at speeds (m/s) to both sides, each with the circle of the identified models.

    Raises ModelError where no draw of the posterior has a settled turn.
    """
    of_models = blended_radius(source, np.array(speeds, dtype=np.float64), rudder, surge)
    return [
        _believed_row(source, belief, float(of_models[side][i]), float(speed), side, rudder)
        for side in SIDES
        for i, speed in enumerate(speeds)
    ]


def _believed_row(source: ParameterSource, belief: Belief, of_model: float, speed: float, side: str, rudder: float) -> TurnRow:
    turn = belief.turn(speed, rudder, SIDES[side], of_model)
    if not np.isfinite(turn.radius):
        raise ModelError(
            f"no draw that the runs allow has a settled turn to {side} at {speed:.3g} m/s",
            found=f"rudder {rudder:.3g} rad",
            hint="fly a turning circle there, and give it with `--measured`",
        )
    because = _reasons_against(turn, flown=source.supports(speed), usual=belief.fitted.is_usual)
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


def _reasons_against(turn: BelievedTurn, *, flown: bool, usual: bool) -> tuple[str, ...]:
    """Return why a turn does not count as identified; empty where the runs covered it and its band is narrow."""
    conditions = {
        "a turn this tight was not flown": turn.curvature_covered >= MIN_COVERED_SHARE,
        "a fin angle this large was not flown": turn.fin_covered >= MIN_COVERED_SHARE,
        "this speed was not flown": flown,
        "the draws are too much alike to tell how wide the band is": turn.effective >= LEAST_EFFECTIVE,
        "the fit lies where no vehicle of the ensemble does": usual,
    }
    failed = (says for says, is_met in conditions.items() if not is_met)
    return (*failed, *doubts_of_draws(turn.radius, turn.interval95, turn.unsettled))


def doubts_of_draws(radius: float, band: tuple[float, float], unsettled: float) -> tuple[str, ...]:
    """Return the reasons in the draws why a turn does not count as identified: a wide band (m, m), or draws that never settle."""
    conditions = {
        f"the band is wider than {MAX_KNOWN_WIDTH:.0%} of the radius": not is_band_only(radius, band),
        f"{unsettled:.0%} of what the runs allow has no settled turn there": unsettled <= MAX_UNSETTLED,
    }
    return tuple(says for says, is_met in conditions.items() if not is_met)
