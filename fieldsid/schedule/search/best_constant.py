"""The best one gain for all speeds: what a schedule has to beat, by the objective that its rows were designed for."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, inf, log

from fieldsid.schedule.controller import Gains
from fieldsid.schedule.search.objective import Place
from fieldsid.schedule.search.optimum import minimum

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
