"""The best gains of a formula at one speed, by its two free numbers: the quickest, and those of least fin that are quick enough.

And the best one gain for all speeds: what a schedule has to beat, by the objective that its rows were designed for.

Every part of the objective is continuous in the gains and in the plant: rows next to each other differ by what the plant differs.
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
"""The whole fin is taken where a little less settles no sooner."""
MOST_TRIES, MOST_TURNS = 12, 4
NEAR_DAMPING = 0.3
"""How far from the damping of the quickest gains, in e-folds, that of slower ones is sought."""


@dataclass(frozen=True, slots=True)
class Found:
    """Gains, the shares of bandwidth and damping they have of the formula's, and what they come to."""

    gains: Gains
    share: float
    more: float
    outcome: Outcome


@dataclass(frozen=True)
class Search:
    """A wish's formula at a place."""

    place: Place
    wish: Wish

    def __reduce__(self) -> tuple[type[Search], tuple[Place, Wish]]:
        return Search, (self.place, self.wish)  # a formula cannot be sent

    @cached_property
    def formula(self) -> Formula:
        """The formula, of which a share of one asks for all of the fin that the step may ask for."""
        return formula_of(self.place.plant, self.wish, self.place.demand.fin_limit * self.wish.most_fin)

    @property
    def most_damping(self) -> float:
        """The largest multiple of the damping wished."""
        return max(MOST_DAMPING / self.wish.damped, 1.0) if self.wish.kind in RATE_FED else 1.0

    def at(self, share: float, more: float) -> Found:
        """Return the gains of both numbers."""
        gains = self.formula(share, more)
        return Found(gains, share, more, self.place.outcome(gains))

    def cost(self, found: Found) -> float:
        """Return the objective at the place."""
        return found.outcome.cost(self.place.demand)

    def quickest(self) -> Found:
        """Return the gains that settle soonest, or of a formula the largest, that lack nothing, or the least."""
        top, less = (self.usual(share) for share in (1.0, NEARLY))
        if top.outcome.serves and self.cost(top) <= self.cost(less):
            return self.damped(1.0)
        return self.damped(exp(minimum(lambda x: self.cost(self.usual(exp(x))), log(SLOWEST_SHARE), 0.0)))

    def usual(self, share: float) -> Found:
        """Return the gains of a share with the usual damping, or that which poles and margins need."""
        usual = DAMPING / self.wish.damped if self.most_damping > 1.0 else 1.0
        return self.at(share, max(self.needed(share), usual))

    def least_fin(self, quick: Found) -> Found:
        """Return the gains of least fin that settle as soon as is asked; the quickest where these do not."""
        bare = self.at(quick.share, self.needed(quick.share))
        found = self._better(self._slowed(quick), self._slowed(bare))
        for _ in range(MOST_TURNS):
            near = log(found.more)
            more = least(self._of_damping(found.share), max(near - NEAR_DAMPING, 0.0), near + NEAR_DAMPING)
            better = self._better(found, self._slowed(self.at(found.share, min(exp(more), self.most_damping))))
            gained, found = found.share / better.share - 1.0, better
            if gained < ROUNDING:
                break
        return found

    def _better(self, *found: Found) -> Found:
        return min(found, key=lambda f: (self.cost(f), f.share))

    def damped(self, share: float) -> Found:
        """Return the gains of a share with the damping that suits it best."""
        more = self.needed(share)
        if self.most_damping > 1.0:
            more = exp(minimum(self._of_damping(share), log(more), log(self.most_damping)))
        return self.at(share, more)

    def _of_damping(self, share: float) -> Callable[[float], float]:
        return lambda log_more: self.cost(self.at(share, exp(log_more)))

    def needed(self, share: float) -> float:
        """Return the least multiple of the damping with which poles and margins are as asked, or lack the least."""

        def lacking(log_more: float) -> float:
            lacks = sum(map(sum, self.place.linear_lacks(self.formula(share, exp(log_more)))))
            return lacks if lacks > ROUNDING else log_more - log(self.most_damping)

        return exp(minimum(lacking, 0.0, log(self.most_damping))) if self.most_damping > 1.0 and lacking(0.0) > 0.0 else 1.0

    def _slowed(self, best: Found) -> Found:
        """Return the least share that settles in time with a damping, by the secant's rule kept between two shares."""
        asked = self.place.demand.settling

        def late(found: Found) -> float:
            return log(found.outcome.settled / asked) if found.outcome.serves else 1.0

        def at(share: float) -> Found:
            return self.at(share, max(best.more, self.needed(share)))

        high, high_late = best, late(best)
        low, low_late = SLOWEST_SHARE, 1.0
        share = high.share * exp(high_late)  # settling goes with 1/share where the fin is not at its limit
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
    """Return where a cost is least between two places: scanned, then by Brent's method around the best."""
    places = np.linspace(low, high, SCANNED)
    costs = [cost(float(x)) for x in places]
    at = int(np.argmin(costs))
    near = least(cost, float(places[max(at - 1, 0)]), float(places[min(at + 1, SCANNED - 1)]))
    return near if cost(near) < costs[at] else float(places[at])


def least(cost: Callable[[float], float], low: float, high: float) -> float:
    """Return where a cost with one valley between two places is least, by Brent's method."""
    from scipy.optimize import minimize_scalar

    return float(minimize_scalar(cost, bounds=(low, high), method="bounded", options={"xatol": ROUNDING}).x)


MULTIPLES = (1.0, 0.7, 1.4, 0.5, 2.0)
FARTHEST = log(1.5)


def best_constant(candidates: Sequence[Gains], places: Sequence[Place]) -> Gains:
    """Return the gains of least cost at the speed where they cost most; of those that cost alike, the ones of less fin."""
    best, least = candidates[0], (inf, inf)
    for gains in candidates:
        worst, fin = -inf, 0.0
        for place in places:
            found = place.outcome(gains)
            worst, fin = max(worst, found.cost(place.demand)), max(fin, found.fin)
            if (worst, fin) >= least:  # neither falls at another speed
                break
        else:
            best, least = gains, (worst, fin)
    return best


def multiples_of(rows: Sequence[Gains]) -> list[Gains]:
    """Return the gains of rows and multiples of them."""
    return [gains.times(f) for f in MULTIPLES for gains in rows]


def improved(place: Place, start: Gains) -> Gains:
    """Return the best gains near some, sought along all of them and along the rate's alone."""

    def times(own: float, rate: float) -> Gains:
        return Gains(start.kp * exp(own), start.ki * exp(own), start.kd * exp(own + rate))

    def cost(own: float, rate: float) -> float:
        return place.outcome(times(own, rate)).cost(place.demand)

    rate = minimum(lambda x: cost(0.0, x), -FARTHEST, FARTHEST) if start.kd != 0.0 else 0.0
    own = minimum(lambda x: cost(x, rate), -FARTHEST, FARTHEST)
    return times(own, rate)
