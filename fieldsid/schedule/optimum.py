"""Gains as the minimum of one continuous cost: how late the flown step is right, what the margins lack, how wide the band is.

The lateness is sqrt(int t |error| dt) over the step (ITAE; Graham & Lathrop 1953): the time constant of a first-order answer.
What lacks is counted of the estimate (all of the wish), of 95 % of the draws (half of its margin) and of their flown steps.
Every part is continuous in the gains and in the plant: rows next to each other differ by what the plant differs.

The prices are chosen, and what 20 % more or less of each does is what `tests/truth/price_table.py --draws 7 --seed 7` says: PD of
seven hulls identified from pulses, 105 flights of the hulls themselves. Three do nothing: they are limits. Two decide something.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from fieldsid.numerics.arrays import FloatArray
from fieldsid.schedule.controller import Gains
from fieldsid.schedule.flown.pace import Pace
from fieldsid.schedule.flown.response import LIMIT_CYCLE_SHARE, about_rest, lateness, overshoot, settling, step_response, swing
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.margins import HELD_SHARE, PlantResponse, margins, margins_of, plant_response, worst_of
from fieldsid.schedule.record import Row

DRAWS_MARGIN_SHARE = 0.5
"""Share of the wished phase margin that a draw of the errors has to leave: the estimate has all of it."""
SEARCHED_RAD_S = np.geomspace(5e-3, 100.0, 240)
"""Coarser than the margins' own grid: it is interpolated between, and the row found is checked on the fine one."""
LACK_PRICE = 20.0
"""Cost of lacking the whole of a requirement: a tenth of a margin costs more than any time that giving it up could buy.
With 20 % more or less no flight changes."""
BANDWIDTH_PRICE = 0.1
"""A tenth more of bandwidth has to buy 1 % of the time: beyond the fin's limit it buys nothing.
With 20 % more or less no flight changes."""
DAMPING_PRICE = 0.05
"""So that of dampings which lack alike the wished one is taken. With 20 % less steps settle 0.5 % sooner to 0.8 % later, with
20 % more 1.0 % sooner to 0.6 % later, and overshoot by 0.3 % of the step more at most."""
BEYOND_PRICE = 2.0
"""Bandwidth that uses more than the whole fin at the largest error costs more than the time it could buy, which goes with 1.
With 20 % more no flight changes, nor where no bandwidth beyond is allowed at all; but LQR, whose share is one of a weight, then
hunts on a tall hull. With 20 % less steps settle up to 15 % sooner and overshoot by up to 1.2 % of the step more."""
SLOWEST_SHARE, FASTEST_SHARE = 0.03, 2.0
SCANNED = 7
PLACE_ROUNDING = 1e-3
"""To how much of an e-fold the least is found: gains to a thousandth."""
LACK_ROUNDING = 2e-3
FORMULA_ROUNDING = 1e-6
"""A formula that meets the damping exactly must not lack by rounding."""
OWN_PRICE = 5.0
"""What the estimate lacks counts so many times what draws lack: gains that do not serve it are refused.
With 20 % more or less no flight changes."""


@dataclass(frozen=True, slots=True)
class Demand:
    """What gains have to leave: damping of the estimate's poles, phase margin (deg) of the estimate, the step (rad) flown.

    `draws_overshoot` is the share by which 95 % of the draws may overshoot; `fin_limit` (rad) bounds the fin; a step is flown
    at `pace`.
    """

    damping: float
    phase_margin_deg: float
    step: float
    draws_overshoot: float
    fin_limit: float
    pace: Pace


@dataclass(frozen=True, slots=True)
class Found:
    """Gains, the share of the full-fin bandwidth they have, what they lack: of the estimate's margins, and of everything."""

    gains: Gains
    share: float
    own_lack: float
    lack: float


@dataclass(frozen=True, slots=True)
class Flown:
    """What the draws do in the step: share of them held with the margin asked of draws, settling (s) of 95 % of them."""

    held: float
    settling: float


def minimum(cost: Callable[[float], float], low: float, high: float) -> float:
    """Return where a continuous cost is least between two places: scanned, then by Brent's method around the best."""
    places = np.linspace(low, high, SCANNED)
    costs = [cost(float(x)) for x in places]
    at = int(np.argmin(costs))
    around = (float(places[max(at - 1, 0)]), float(places[min(at + 1, SCANNED - 1)]))
    near = minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": PLACE_ROUNDING})
    return float(near.x) if near.fun < costs[at] else float(places[at])


def fastest_gains(family: LinearPlant, attempt: Callable[[float], Gains], demand: Demand) -> Found:
    """Return the gains of the largest share (up to 1) of what an attempt wishes that lack nothing, or the least."""
    known = plant_response(family, SEARCHED_RAD_S)

    def cost(log_share: float) -> float:
        gains = attempt(float(np.exp(log_share)))
        return LACK_PRICE * (linear_lack(known, gains, demand) + flown_lack(family, gains, demand)) - log_share

    share = float(np.exp(minimum(cost, np.log(SLOWEST_SHARE), 0.0)))
    return _found(known, attempt(share), share, demand)


def soonest_gains(
    family: LinearPlant, attempt: Callable[[float, float], Gains], demand: Demand, most_damping: float, *, bounded: bool
) -> Found:
    """Return the gains of least cost over bandwidth and damping, an attempt's shares of those wished.

    `most_damping` is the largest multiple of the wished damping; `bounded` keeps to a bandwidth that was asked for.
    """
    most, known = float(np.log(most_damping)), plant_response(family, SEARCHED_RAD_S)

    def needed(share: float) -> float:
        def lacking(log_more: float) -> float:
            return LACK_PRICE * linear_lack(known, attempt(share, float(np.exp(log_more))), demand) + DAMPING_PRICE * log_more

        return minimum(lacking, 0.0, most) if most > 0.0 and linear_lack(known, attempt(share, 1.0), demand) > 0.0 else 0.0

    def cost(share: float, log_more: float) -> float:
        gains = attempt(share, float(np.exp(log_more)))
        late, lack = _lateness_and_lack(family, gains, demand)
        beyond = BANDWIDTH_PRICE * np.log(share) + BEYOND_PRICE * max(np.log(share), 0.0)
        price = -np.log(share) if bounded else np.log(late) + beyond
        return float(price + DAMPING_PRICE * log_more + LACK_PRICE * (linear_lack(known, gains, demand) + lack))

    def of_share(log_share: float) -> float:
        share = float(np.exp(log_share))
        return cost(share, needed(share))

    place = minimum(of_share, np.log(SLOWEST_SHARE), 0.0 if bounded else np.log(FASTEST_SHARE))
    # the price has its corner at the whole fin: met exactly, a row is the formula's, not a thousandth off
    share = 1.0 if abs(place) <= 2.0 * PLACE_ROUNDING and of_share(0.0) <= of_share(place) else float(np.exp(place))
    more = minimum(lambda x: cost(share, x), needed(share), most) if most > 0.0 else 0.0
    return _found(known, attempt(share, float(np.exp(more))), share, demand)


def linear_lack(known: PlantResponse, gains: Gains, demand: Demand) -> float:
    """Return what poles and phase margins lack, each as a share of what is asked; zero where nothing lacks."""
    own, draws = _lacks(known, gains, demand)
    return OWN_PRICE * own + draws


def _lacks(known: PlantResponse, gains: Gains, demand: Demand) -> tuple[float, float]:
    """Return what the estimate's poles and margin lack, and what the margins of 95 % of the draws do."""
    asked = demand.phase_margin_deg
    found = margins_of(known, gains)
    phase, poles = found.phase_deg, max(demand.damping - float(found.damping[0]), 0.0) / demand.damping
    own = poles + max(asked - float(phase[0]), 0.0) / asked
    draws = _of_draws((DRAWS_MARGIN_SHARE * asked - phase) / asked) if known.plant.count > 1 else 0.0
    return own if own > FORMULA_ROUNDING else 0.0, draws


def _of_draws(lacks: FloatArray) -> float:
    """Return what 95 % of the draws lack, (d,): the worst of them and their mean, each draw's at most a whole requirement.

    The worst is a corner that the least of a cost keeps to; where it cannot be met the mean still tells more from fewer draws.
    """
    held = np.sort(np.clip(np.where(np.isfinite(lacks), lacks, np.sign(lacks)), 0.0, 1.0))
    best = held[: int(np.ceil(HELD_SHARE * held.size - 1e-9))]
    return float(best[-1] + np.mean(best))


def flown_lack(family: LinearPlant, gains: Gains, demand: Demand) -> float:
    """Return by how much the flown steps of 95 % of the draws overshoot or swing more than they may."""
    return _lateness_and_lack(family, gains, demand)[1]


def _lateness_and_lack(family: LinearPlant, gains: Gains, demand: Demand) -> tuple[float, float]:
    time, angle = _step(family, gains, demand)
    moved = about_rest(angle, demand.step)
    late = lateness(time, moved, demand.step)
    late[0] = lateness(time, angle, demand.step)[0]  # its trim is known: what it has not reached is late
    slowest = max(float(late[0]), worst_of(late, most=True))
    over, left = overshoot(moved, demand.step) - demand.draws_overshoot, swing(angle, demand.step) - LIMIT_CYCLE_SHARE
    return slowest, _of_draws(np.maximum(over, 0.0) + np.maximum(left, 0.0))


def _step(family: LinearPlant, gains: Gains, demand: Demand) -> tuple[FloatArray, FloatArray]:
    reference_gain = float(family.stiffness[0]) / float(family.slow_authority[0])
    row = Row(family.speed, gains, -float(family.offset[0]), reference_gain, demand.fin_limit)
    steps = step_response(family, row, reference=demand.step, seconds=demand.pace.flight, step_s=demand.pace.step)
    return steps.time, steps.angle


def _found(known: PlantResponse, gains: Gains, share: float, demand: Demand) -> Found:
    own, draws = _lacks(known, gains, demand)
    return Found(gains, share, own, own + draws + flown_lack(known.plant, gains, demand))


def flown(family: LinearPlant, gains: Gains, demand: Demand) -> Flown:
    """Return what the draws do with gains."""
    time, angle = _step(family, gains, demand)
    moved = about_rest(angle, demand.step)
    rests = (overshoot(moved, demand.step) <= demand.draws_overshoot) & (swing(angle, demand.step) <= LIMIT_CYCLE_SHARE)
    phase = margins(family, gains).phase_deg
    damped = phase >= DRAWS_MARGIN_SHARE * demand.phase_margin_deg - LACK_ROUNDING * demand.phase_margin_deg
    return Flown(float(np.mean(rests & damped)), worst_of(settling(time, moved, demand.step), most=True))
