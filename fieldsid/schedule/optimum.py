"""Gains of least quadratic cost that meet what is asked of them: requirements that hold, and weights from what is at hand.

At every bandwidth the damping is the least with which the requirements hold: the estimate has the damping of its poles and the
phase margin asked, 95 % of the draws half of that margin, their flown steps overshoot no more than such a margin does and come
to rest, and the sensors' noise leaves the fin its travel. Among the bandwidths with which they hold, that of the least
int (error / largest error)^2 + (fin / its limit)^2 dt over the flown step, the mean of the draws: the error counts as the
largest one that is to be met, the fin as what it has (Bryson & Ho 1975, section 5.2), and there is nothing left to choose.
All of this is continuous in the gains and in the plant: rows next to each other differ by what the plant differs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from fieldsid.schedule.controller import Gains, least_damping
from fieldsid.schedule.flown.response import (
    LIMIT_CYCLE_SHARE,
    MOST_ERROR,
    Steps,
    about_rest,
    overshoot,
    settling,
    step_response,
    swing,
)
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.margins import margins, worst_of
from fieldsid.schedule.record import Row

DRAWS_MARGIN_SHARE = 0.5
"""Share of the wished phase margin that a draw of the errors has to leave: the estimate has all of it."""
NOISE_SHARE = 0.1
"""Standard deviation that the sensors' noise may have at the fin, over its limit and over its rate: three of them leave the loop
two thirds of either."""
AUTOPILOT_PERIOD_S = 0.1
"""A fin without a lag of its own moves over so much time: autopilots of such vehicles run at 10 Hz or so."""
SEARCHED_RAD_S = np.geomspace(5e-3, 100.0, 240)
"""Coarser than the margins' own grid: it is interpolated between, and the row found is checked on the fine one."""
SLOWEST_SHARE, FASTEST_SHARE = 0.03, 1.5
"""Of the bandwidth that uses the whole fin at the largest error."""
BANDWIDTHS, DAMPINGS = 13, 5
"""Places looked at before what lies between two of them is halved."""
PLACE_ROUNDING = 1e-3
"""To how much of an e-fold a place is found: gains to a thousandth."""
FORMULA_ROUNDING = 1e-6
"""A formula that meets the damping exactly must not lack by rounding."""
LACK_ROUNDING = 2e-3


@dataclass(frozen=True, slots=True)
class Demand:
    """What gains have to leave: damping of the estimate's poles, phase margin (deg) of the estimate, the step (rad) flown.

    `draws_overshoot` is the share by which 95 % of the draws may overshoot; `fin_limit` (rad) bounds the fin; a step is flown
    for `seconds`; `angle_noise` (rad) and `rate_noise` (rad/s) are the sensors'.
    """

    damping: float
    phase_margin_deg: float
    step: float
    draws_overshoot: float
    fin_limit: float
    seconds: float
    angle_noise: float = 0.0
    rate_noise: float = 0.0


@dataclass(frozen=True, slots=True)
class Found:
    """Gains, the share of the full-fin bandwidth they have, and what they lack of the requirement they are farthest from."""

    gains: Gains
    share: float
    lack: float


@dataclass(frozen=True, slots=True)
class Flown:
    """What the draws do in the step: share of them held with the margin asked of draws, settling (s) of 95 % of them."""

    held: float
    settling: float


def least_place(lack: Callable[[float], float], low: float, high: float, count: int) -> float | None:
    """Return the least place at which a continuous lack is nil, looked at from below in `count` places; None where none is."""
    before, of_before = low, lack(low)
    if of_before <= LACK_ROUNDING:
        return low
    for place in map(float, np.linspace(low, high, count)[1:]):
        found = lack(place)
        if found <= 0.0:
            return _edge(lack, before, place)
        before = place
    return None


def _edge(lack: Callable[[float], float], outside: float, inside: float) -> float:
    """Return the place next to where a lack vanishes on the way from `outside` to `inside`, on the side where it is nil."""
    place = float(brentq(lack, outside, inside, xtol=PLACE_ROUNDING))
    return place + (1.0 if inside > outside else -1.0) * min(PLACE_ROUNDING, abs(inside - place))


def minimum(cost: Callable[[float], float], low: float, high: float, count: int) -> float:
    """Return where a continuous cost is least between two places: scanned, then by Brent's method around the best."""
    places = np.linspace(low, high, count)
    costs = [cost(float(x)) for x in places]
    at = int(np.argmin(costs))
    around = (float(places[max(at - 1, 0)]), float(places[min(at + 1, count - 1)]))
    near = minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": PLACE_ROUNDING})
    return float(near.x) if near.fun < costs[at] else float(places[at])


def fastest_gains(family: LinearPlant, attempt: Callable[[float], Gains], demand: Demand) -> Found:
    """Return the gains of the largest share (up to 1) of what an attempt wishes that lack nothing, or those that lack least."""
    return _Search(family, lambda share, _: attempt(share), demand, 0.0).fastest(0.0)


def best_gains(
    family: LinearPlant, attempt: Callable[[float, float], Gains], demand: Demand, most_damping: float, *, bounded: bool
) -> Found:
    """Return the gains of least cost that lack nothing over bandwidth and damping, an attempt's shares of those wished.

    `most_damping` is the largest multiple of the wished damping; `bounded` keeps to a bandwidth that was asked for. Where all
    lack something they are those that lack least.
    """
    search = _Search(family, attempt, demand, float(np.log(most_damping)))
    return search.fastest(0.0) if bounded else search.best(float(np.log(FASTEST_SHARE)))


@dataclass(frozen=True, slots=True)
class _Tried:
    """What was found at one bandwidth, a logarithm: that of the damping, what lacks, the step's cost (s)."""

    place: float
    more: float
    lack: float
    cost: float

    @property
    def serves(self) -> bool:
        return self.lack <= LACK_ROUNDING


@dataclass(frozen=True, slots=True)
class _Search:
    """Bandwidths from the fastest down, at each the least damping that serves; places are logarithms of shares."""

    family: LinearPlant
    attempt: Callable[[float, float], Gains]
    demand: Demand
    most: float

    def gains(self, place: float, more: float) -> Gains:
        return self.attempt(float(np.exp(place)), float(np.exp(more)))

    def lack(self, place: float, more: float) -> float:
        return lack(self.family, self.gains(place, more), self.demand)

    def tried(self, place: float) -> _Tried:
        """Return the least damping that serves at a bandwidth, that which lacks least where none does."""

        def linear(more: float) -> float:
            return linear_lack(self.family, self.gains(place, more), self.demand)

        more: float | None = 0.0
        if self.most > 0.0:
            more = least_place(linear, 0.0, self.most, DAMPINGS)
        cost, found = np.inf, np.inf
        if more is not None:
            cost, found = _cost_and_lack(self.family, self.gains(place, more), self.demand)
            if found > LACK_ROUNDING and self.most > more:
                more = least_place(lambda x: self.lack(place, x), more, self.most, DAMPINGS)
        if more is None:
            more = minimum(lambda x: self.lack(place, x), 0.0, self.most, DAMPINGS)
        if not found <= LACK_ROUNDING:
            cost, found = _cost_and_lack(self.family, self.gains(place, more), self.demand)
        return _Tried(place, more, found, cost)

    def lack_at(self, place: float) -> float:
        return self.tried(place).lack

    def served(self, highest: float) -> tuple[list[_Tried], float | None]:
        """Return what serves from the fastest of some places down to one beyond the least cost, and the place above the first."""
        above, found = None, []
        for place in map(float, np.linspace(highest, np.log(SLOWEST_SHARE), BANDWIDTHS)):
            tried = self.tried(place)
            if tried.serves:
                found.append(tried)
                if len(found) > 1 and tried.cost > found[-2].cost:
                    break
            elif found:
                break
            else:
                above = place
        return found, above

    def top(self, first: _Tried, above: float | None) -> _Tried:
        """Return what is found at the fastest bandwidth that serves."""
        return first if above is None or first.lack > 0.0 else self.tried(_edge(self.lack_at, above, first.place))

    def fastest(self, highest: float) -> Found:
        found, above = self.served(highest)
        return self.found(self.top(found[0], above)) if found else self.least()

    def best(self, highest: float) -> Found:
        found, above = self.served(highest)
        if not found:
            return self.least()
        step = (highest - float(np.log(SLOWEST_SHARE))) / (BANDWIDTHS - 1)
        near = min(found, key=lambda t: t.cost)
        most = near.place + step
        if near is found[0]:
            most = self.top(near, above).place
        around = (near.place - step, min(most, highest))
        least = minimize_scalar(
            lambda x: self.priced(float(x)), bounds=around, method="bounded", options={"xatol": PLACE_ROUNDING}
        )
        tried = self.tried(float(least.x))
        return self.found(tried if tried.serves and tried.cost < near.cost else near)

    def priced(self, place: float) -> float:
        """Return the cost at a bandwidth that serves, infinite at one that does not."""
        tried = self.tried(place)
        return tried.cost if tried.serves else np.inf

    def least(self) -> Found:
        """Return the gains that lack least."""
        place = minimum(self.lack_at, float(np.log(SLOWEST_SHARE)), 0.0, BANDWIDTHS)
        return self.found(self.tried(place))

    def found(self, tried: _Tried) -> Found:
        return Found(self.gains(tried.place, tried.more), float(np.exp(tried.place)), max(tried.lack, 0.0))


def linear_lack(family: LinearPlant, gains: Gains, demand: Demand) -> float:
    """Return what the requirement lacks that is missed most, as a share of it, of poles, margins and noise; below nil: none."""
    asked = demand.phase_margin_deg
    phase = margins(family, gains, SEARCHED_RAD_S).phase_deg
    lacks = [
        (demand.damping - float(least_damping(family.one(), gains)[0])) / demand.damping,
        (asked - float(phase[0])) / asked,
        worst_of((DRAWS_MARGIN_SHARE * asked - phase) / asked, most=True),
        noise_share(family, gains, demand) / NOISE_SHARE - 1.0,
    ]
    return max(lacks) - FORMULA_ROUNDING


def noise_share(family: LinearPlant, gains: Gains, demand: Demand) -> float:
    """Return the standard deviation of the sensors' noise at the fin over its limit, or over its rate where that is more."""
    moved = float(np.hypot(gains.kp * demand.angle_noise, gains.kd * demand.rate_noise))
    rate = moved / max(float(family.lag[0]), AUTOPILOT_PERIOD_S)
    return max(moved / demand.fin_limit, rate / float(family.fin_rate[0]))


def lack(family: LinearPlant, gains: Gains, demand: Demand) -> float:
    """Return what the requirement lacks that is missed most: those of `linear_lack`, and those of the flown steps."""
    return _cost_and_lack(family, gains, demand)[1]


def _cost_and_lack(family: LinearPlant, gains: Gains, demand: Demand) -> tuple[float, float]:
    """Return the mean quadratic cost (s) of the draws' steps, and what lacks."""
    steps = _step(family, gains, demand)
    moved = about_rest(steps.angle, demand.step)
    over, left = overshoot(moved, demand.step) - demand.draws_overshoot, swing(steps.angle, demand.step) - LIMIT_CYCLE_SHARE
    missed = worst_of(np.maximum(over, left), most=True)
    return quadratic_cost(steps, demand.step, demand.fin_limit), max(missed, linear_lack(family, gains, demand))


def quadratic_cost(steps: Steps, size: float, fin_limit: float) -> float:
    """Return int (error / size)^2 + (fin / limit)^2 dt of steps, the mean of all, s; the fin about where it comes to rest.

    An error counts up to one that is three times the step: what diverges costs that.
    """
    off = steps.angle / size - 1.0
    fin = (steps.fin - steps.fin[-1]) / fin_limit
    each = np.minimum(np.nan_to_num(off**2, nan=np.inf), MOST_ERROR**2) + np.minimum(np.nan_to_num(fin**2), 4.0)
    return float(np.mean(np.sum(each, axis=0)) * (steps.time[1] - steps.time[0]))


def _step(family: LinearPlant, gains: Gains, demand: Demand) -> Steps:
    reference_gain = float(family.stiffness[0]) / float(family.slow_authority[0])
    row = Row(family.speed, gains, -float(family.offset[0]), reference_gain, demand.fin_limit)
    # a trim that is known to no better moves where a loop comes to rest, and not how: all fly with that of the estimate
    trimmed = replace(family, offset=np.full(family.count, family.offset[0]))
    return step_response(trimmed, row, reference=demand.step, seconds=demand.seconds)


def flown(family: LinearPlant, gains: Gains, demand: Demand) -> Flown:
    """Return what the draws do with gains."""
    steps = _step(family, gains, demand)
    moved = about_rest(steps.angle, demand.step)
    rests = (overshoot(moved, demand.step) <= demand.draws_overshoot + LACK_ROUNDING) & (
        swing(steps.angle, demand.step) <= LIMIT_CYCLE_SHARE
    )
    phase = margins(family, gains).phase_deg
    damped = phase >= DRAWS_MARGIN_SHARE * demand.phase_margin_deg - LACK_ROUNDING * demand.phase_margin_deg
    return Flown(float(np.mean(rests & damped)), worst_of(settling(steps.time, moved, demand.step), most=True))
