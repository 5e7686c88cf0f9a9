"""The plant of a vehicle in surge, sway and yaw, by draws of what all runs together make believe: linear about a straight run."""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.numerics.arrays import FloatArray
from fieldsid.schedule.linear_plant import FinLimits, LinearPlant
from fieldsid.turning.maneuvering.belief import Belief
from fieldsid.turning.maneuvering.equations import NAMES, REFERENCE_SPEED_M_S, coefficients, rudder_lift

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
    damping, authority, slow, by_rate, by_fin = _about_straight(hull, near.speed)
    return LinearPlant(
        axis=Axis.YAW,
        speed=near.speed,
        damping=damping,
        stiffness=zero,
        authority=way * authority,
        offset=near.offset[which],
        quadratic=zero,
        beyond_square=zero,
        cross_damping=slow,
        cross_rate=by_rate,
        cross_fin=way * by_fin,
        cross_quadratic=zero,
        cross_share=zero + 1.0,
        strip_moment=zero,
        strip_force=zero,
        strip_flow=zero,
        lag=hull[:, LAG] if limits.lag is None else zero + limits.lag,
        delay=near.delay[which],
        fin_rate=hull[:, RATE] if limits.rate is None else zero + limits.rate,
        powers=np.zeros((draws, near.powers.shape[1])),
        speed_loss=np.zeros((draws, near.speed_loss.shape[1])),
        hull=hull,
    )


def _about_straight(hull: FloatArray, speed: float) -> tuple[FloatArray, ...]:
    """Return damping, authority and the cross state's damping, share of the rate and share of the fin, (d,) each.

    The cross state is the moment that sway makes: x = n_v v, x' = y_v x + n_v y_r r + n_v y_fin fin.
    """
    p = dict(zip(NAMES, hull.T, strict=True))
    length, gyration, arm, still = p["length"], p["gyration"], p["rudder_arm"], REFERENCE_SPEED_M_S
    lift = np.array([rudder_lift(h, speed) for h in hull])
    of_sway = np.maximum(p["sway_lift"] * speed + p["sway_viscous"] * still, 0.0) + lift * speed
    sway_by_rate, sway_by_fin = -(p["sway_rate"] + lift * arm) * speed, lift * speed**2 / length
    by_sway = -(p["yaw_lift"] + arm * lift) * speed / (gyration * length**2)
    damping = (p["yaw_rate"] * speed + p["yaw_viscous"] * still + arm**2 * lift * speed) / (gyration * length)
    authority = arm * lift * speed**2 / (gyration * length**2)
    return damping, authority, of_sway / length, -by_sway * sway_by_rate, by_sway * sway_by_fin
