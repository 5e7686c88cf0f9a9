"""The best gains of a formula at one speed over its two free numbers: the quickest, or those of least fin that are quick enough.

And the best constant gain for all speeds, with which a schedule is compared by the objective of its rows.

Every part of the objective is continuous in the gains and in the plant, so that neighbouring rows differ only as the plant does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import exp, inf, log

import numpy as np

from fieldsid.schedule.controller import Gains
from fieldsid.schedule.search.formulas import Formula, formula_of
from fieldsid.schedule.search.objective import ROUNDING, Outcome, Place
from fieldsid.schedule.wish import DAMPING, MOST_DAMPING, RATE_FED, Wish

SLOWEST_SHARE = 0.03
SCANNED = 7
NEARLY = 0.95
"""Share of the full bandwidth: where it settles no sooner than the full one, the full one is taken."""
MOST_TRIES, MOST_TURNS = 12, 4
NEAR_DAMPING = 0.3
"""Half width, in the logarithm, of the range about the current damping in which that of slower gains is searched."""


@dataclass(frozen=True, slots=True)
class Found:
    """Gains, their bandwidth and damping over the formula's (`share` and `more`), and their outcome."""

    gains: Gains
    share: float
    more: float
    outcome: Outcome


@dataclass(frozen=True)
class Search:
    """The search for the gains of a wish's formula at a place."""

    place: Place
    wish: Wish

    def __reduce__(self) -> tuple[type[Search], tuple[Place, Wish]]:
        return Search, (self.place, self.wish)  # a formula cannot be pickled

    @cached_property
    def formula(self) -> Formula:
        """The formula; a share of one uses all of the fin that the step may use."""
        return formula_of(self.place.plant, self.wish, self.place.demand.fin_limit * self.wish.most_fin)

    @property
    def most_damping(self) -> float:
        """The largest multiple of the required damping."""
        return max(MOST_DAMPING / self.wish.damped, 1.0) if self.wish.kind in RATE_FED else 1.0

    def at(self, share: float, more: float) -> Found:
        """Return the gains for a share of the bandwidth and a multiple of the damping."""
        gains = self.formula(share, more)
        return Found(gains, share, more, self.place.outcome(gains))

    def cost(self, found: Found) -> float:
        """Return the cost of gains at the place."""
        return found.outcome.cost(self.place.demand)

    def quickest(self) -> Found:
        """Return the gains that settle soonest, or for a formula the largest ones, that meet all requirements or come closest."""
        top, less = (self.usual(share) for share in (1.0, NEARLY))
        if top.outcome.serves and self.cost(top) <= self.cost(less):
            return self.damped(1.0)
        return self.damped(exp(minimum(lambda x: self.cost(self.usual(exp(x))), log(SLOWEST_SHARE), 0.0)))

    def usual(self, share: float) -> Found:
        """Return the gains for a share with the usual damping, or the larger one that poles and margins need."""
        usual = DAMPING / self.wish.damped if self.most_damping > 1.0 else 1.0
        return self.at(share, max(self.needed(share), usual))

    def least_fin(self, quick: Found) -> Found:
        """Return the gains of least fin that settle in the required time; the quickest where these do not."""
        least_damped = self.at(quick.share, self.needed(quick.share))
        found = self._best_of(self._slowed(quick), self._slowed(least_damped))
        for _ in range(MOST_TURNS):
            near = log(found.more)
            more = least(self._of_damping(found.share), max(near - NEAR_DAMPING, 0.0), near + NEAR_DAMPING)
            better = self._best_of(found, self._slowed(self.at(found.share, min(exp(more), self.most_damping))))
            gained, found = found.share / better.share - 1.0, better
            if gained < ROUNDING:
                break
        return found

    def _best_of(self, *found: Found) -> Found:
        return min(found, key=lambda f: (self.cost(f), f.share))

    def damped(self, share: float) -> Found:
        """Return the gains for a share with the damping of least cost."""
        more = self.needed(share)
        if self.most_damping > 1.0:
            more = exp(minimum(self._of_damping(share), log(more), log(self.most_damping)))
        return self.at(share, more)

    def _of_damping(self, share: float) -> Callable[[float], float]:
        return lambda log_more: self.cost(self.at(share, exp(log_more)))

    def needed(self, share: float) -> float:
        """Return the least multiple of the damping with which poles and margins meet the requirements, or come closest."""

        def shortfall(log_more: float) -> float:
            total = sum(map(sum, self.place.linear_shortfalls(self.formula(share, exp(log_more)))))
            return total if total > ROUNDING else log_more - log(self.most_damping)

        return exp(minimum(shortfall, 0.0, log(self.most_damping))) if self.most_damping > 1.0 and shortfall(0.0) > 0.0 else 1.0

    def _slowed(self, best: Found) -> Found:
        """Return the least share that settles in the required time, by the secant method in the logarithm with a bracket."""
        required = self.place.demand.settling

        def late(found: Found) -> float:
            return log(found.outcome.settled / required) if found.outcome.serves else 1.0

        def at(share: float) -> Found:
            return self.at(share, max(best.more, self.needed(share)))

        high, high_late = best, late(best)
        low, low_late = SLOWEST_SHARE, 1.0
        share = high.share * exp(high_late)  # settling is proportional to 1/share while the fin is not at its limit
        for _ in range(MOST_TRIES):
            if high_late > -ROUNDING or high.share / low < 1.0 + ROUNDING:
                break
            found = at(min(max(share, low), high.share))
            if late(found) > 0.0:
                low, low_late = found.share, late(found)
            else:
                high, high_late = found, late(found)
            secant = low_late / (low_late - high_late)
            share = low * (high.share / low) ** min(max(secant, 0.1), 0.95)
        return high


def minimum(cost: Callable[[float], float], low: float, high: float) -> float:
    """Return the argument of the least cost between two bounds: by a scan, then by Brent's method around the best point."""
    places = np.linspace(low, high, SCANNED)
    costs = [cost(float(x)) for x in places]
    at = int(np.argmin(costs))
    near = least(cost, float(places[max(at - 1, 0)]), float(places[min(at + 1, SCANNED - 1)]))
    return near if cost(near) < costs[at] else float(places[at])


def least(cost: Callable[[float], float], low: float, high: float) -> float:
    """Return the argument of the least cost between two bounds for a cost with one minimum, by Brent's method."""
    from scipy.optimize import minimize_scalar

    return float(minimize_scalar(cost, bounds=(low, high), method="bounded", options={"xatol": ROUNDING}).x)


MULTIPLES = (1.0, 0.7, 1.4, 0.5, 2.0)
FARTHEST = log(1.5)


def best_constant(candidates: Sequence[Gains], places: Sequence[Place]) -> Gains:
    """Return the candidate whose largest cost over the speeds is least; of equal ones that of the least fin."""
    best, least = candidates[0], (inf, inf)
    for gains in candidates:
        worst, fin = -inf, 0.0
        for place in places:
            found = place.outcome(gains)
            worst, fin = max(worst, found.cost(place.demand)), max(fin, found.fin)
            if (worst, fin) >= least:  # both can only grow at further speeds
                break
        else:
            best, least = gains, (worst, fin)
    return best


def multiples_of(rows: Sequence[Gains]) -> list[Gains]:
    """Return the gains of rows and multiples of them."""
    return [gains.times(f) for f in MULTIPLES for gains in rows]


def improved(place: Place, start: Gains) -> Gains:
    """Return the best gains near a start: searched along a factor on kd, then along a common factor on all gains."""

    def times(own: float, rate: float) -> Gains:
        return Gains(start.kp * exp(own), start.ki * exp(own), start.kd * exp(own + rate))

    def cost(own: float, rate: float) -> float:
        return place.outcome(times(own, rate)).cost(place.demand)

    rate = minimum(lambda x: cost(0.0, x), -FARTHEST, FARTHEST) if start.kd != 0.0 else 0.0
    own = minimum(lambda x: cost(x, rate), -FARTHEST, FARTHEST)
    return times(own, rate)
