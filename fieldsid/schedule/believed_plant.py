"""The plant of a vehicle in surge, sway and yaw, by draws of what all runs together make believe: linear about a straight run."""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.hull import Core
from fieldsid.schedule.linear_plant import FinLimits, LinearPlant
from fieldsid.turning.maneuvering.belief import Belief
from fieldsid.turning.maneuvering.equations import NAMES, about_straight, coefficients

LAG, RATE = NAMES.index("lag"), NAMES.index("rate_limit")


def believed_plant(belief: Belief, near: LinearPlant, limits: FinLimits, draws: int) -> LinearPlant:
    """Return a belief's plant at the speed of `near`, the plant of the models there: `draws` of it, the likeliest first.

    Which way the fin turns, its trim and its delay are the models': a trim is the speed's own, and a delay is one of the path
    that the belief has been given. Lag and rate are the belief's, unless they are stated.
    """
    drawn = belief.posterior.vectors
    taken = drawn[np.linspace(0, drawn.shape[0] - 1, draws - 1).round().astype(int)] if draws > 1 else drawn[:0]
    hull = np.array([coefficients(v) for v in (belief.fitted.vector, *taken)])
    which = np.arange(draws) % near.count
    zero = np.zeros(draws)
    way = -float(np.sign(near.authority[0]))  # as the runs were read: what a model's sway makes of it in the end may differ
    (sway, sway_by_rate, sway_by_fin), (by_sway, by_rate, by_fin) = about_straight(hull, near.speed).transpose(1, 2, 0)
    # the cross state is the moment that sway makes
    states = zip(-sway, -by_sway * sway_by_rate, way * by_sway * sway_by_fin, strict=True)
    core = np.array([Core(cross_damping=c, cross_rate=r, cross_fin=f) for c, r, f in states])
    return LinearPlant(
        axis=Axis.YAW,
        speed=near.speed,
        damping=-by_rate,
        stiffness=zero,
        authority=way * by_fin,
        offset=near.offset[which],
        core=core,
        lag=hull[:, LAG] if limits.lag is None else zero + limits.lag,
        delay=near.delay[which],
        fin_rate=hull[:, RATE] if limits.rate is None else zero + limits.rate,
        powers=np.zeros((draws, near.powers.shape[1])),
        speed_loss=np.zeros((draws, near.speed_loss.shape[1])),
        hull=hull,
    )
