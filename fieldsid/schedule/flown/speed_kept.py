"""The speed a loop's flights lose in the turn: as measured in the models' runs, else what such vehicles usually lose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.hull import QUADRATIC, STRIP_MOMENT
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.turning.steady.speed_loss import TYPICAL_LOSS, SurgeModel, draw_speed_loss


def slowing(plant: LinearPlant, surge: SurgeModel | None, fin_limit: float, seed: int) -> LinearPlant:
    """Return a yaw plant that loses speed in its turns, a draw of the loss for each of its own; a pitch plant as it is."""
    if plant.axis is not Axis.YAW:
        return plant
    curvature = abs(_full_rate(plant.one(), fin_limit)) / plant.speed
    loss = draw_speed_loss(surge, max(curvature, 1e-3), plant.count, np.random.default_rng(seed))
    return replace(plant, speed_loss=np.column_stack([loss.drag, loss.fin, loss.turn]))


def _full_rate(one: LinearPlant, fin_limit: float) -> float:
    """Return the steady rate (rad/s) of a fin at its limit, r of a r + q r^2 = |b| delta; one that nothing holds by q alone."""
    a, q = float(one.slow_damping[0]), float(one.core[0, QUADRATIC] + one.core[0, STRIP_MOMENT])
    push = abs(float(one.slow_authority[0])) * fin_limit
    if q > 0.0:
        return float((-a + np.sqrt(a * a + 4.0 * q * push)) / (2.0 * q))
    return push / max(a, 0.05)


def speed_kept_said(axis: Axis, surge: SurgeModel | None) -> str:
    """Return where the loss of speed comes from, in words."""
    if axis is not Axis.YAW:
        return "speed held"
    if surge is not None and surge.surge_measured:
        return "speed lost in the turn as measured in the runs"
    return f"no run to measure the speed lost in the turn: {100 * TYPICAL_LOSS:.0f} % assumed at full fin"
