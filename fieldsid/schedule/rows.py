"""The rows of a schedule: the quickest gains of each speed, slowed to a common settling time, not worse than a constant gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, degrees

from fieldsid.errors import UsageError
from fieldsid.runtime.parallel_map import parallel_map
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.plants import Plants
from fieldsid.schedule.record import Row
from fieldsid.schedule.search.design import Sought, answering, quickest, row_of, with_bandwidth
from fieldsid.schedule.search.objective import BETTER_SHARE, Place, demand_of
from fieldsid.schedule.search.optimum import best_constant, improved, multiples_of
from fieldsid.schedule.wish import QUICKEST, Wish

DESIGN_DRAWS = 24
SEED = 41
AS_THE_CONSTANT = "the best constant gain, from which it was sought"


def design_rows(
    plants: Plants, knots: Sequence[float], wish: Wish, limit: float, *, depth: bool
) -> tuple[tuple[Row, ...], float]:
    """Return a row for each speed, and the common settling time (s), QUICKEST where each has its own.

    The fin is limited to +/-limit rad; `depth` adds the depth loop. Raises ModelError where no gains stabilise a loop, and
    UsageError where none are as quick as required.
    """
    quick = parallel_map(lambda speed: quickest(plants.at(speed, limit, DESIGN_DRAWS, SEED), wish, limit), knots)
    answer = _answer(quick, wish)
    found = quick
    if wish.bandwidth is not None:
        found = _with_bandwidth(quick, wish.bandwidth)
    elif answer > QUICKEST:
        as_slow = "" if wish.settling is not None else f" as at {_slowest(quick).plant.speed:.3g} m/s"
        found = parallel_map(lambda sought: answering(sought, answer, f"settling {answer:.3g} s{as_slow}"), quick)
    found = _no_worse_than_one(found, [place_of(s.plant, wish, limit, answer) for s in found])
    supports = plants.source.supports
    return tuple(parallel_map(lambda s: row_of(s, depth=depth, supported=supports(s.plant.speed)), found)), answer


def place_of(plant: LinearPlant, wish: Wish, fin_limit: float, answer: float) -> Place:
    """Return the plant of one speed with the requirements there, on which gains are evaluated."""
    family = plant.distinct()
    place = Place(family, demand_of(family, wish, fin_limit, answer))
    return place if wish.bandwidth is None else place.with_bandwidth(wish.bandwidth)


def _answer(quick: Sequence[Sought], wish: Wish) -> float:
    """Return the common settling time (s): the required one, else that of the slowest speed."""
    if wish.is_formula or wish.bandwidth is not None or wish.settling == QUICKEST:
        return QUICKEST
    slowest = _slowest(quick)
    if wish.settling is not None and slowest.settled > (1.0 + BETTER_SHARE) * wish.settling:
        raise _too_quick(slowest, wish.settling)
    return slowest.settled if wish.settling is None else wish.settling


def _slowest(quick: Sequence[Sought]) -> Sought:
    """Return the speed with the longest settling time among those whose gains meet all requirements, else the first speed."""
    return max((s for s in quick if s.found.outcome.serves), key=lambda s: s.settled, default=quick[0])


def _too_quick(slowest: Sought, settling: float) -> UsageError:
    possible = ceil(10.0 * (1.0 + BETTER_SHARE) * slowest.settled) / 10.0
    return UsageError(
        f"no gains settle a {degrees(slowest.step):.3g} deg step within {settling:.3g} s at {slowest.plant.speed:.3g} m/s",
        found=f"{slowest.settled:.3g} s there, bound by {slowest.binds}; {_path(slowest)}",
        hint=f"`--settling {possible:g}s` is possible at all of these speeds, `--settling quickest` leaves each its own",
    )


def _path(sought: Sought) -> str:
    """Return the lag and delay of the fin in words, which cost phase margin."""
    return f"fin lag {sought.plant.lag[0]:.3g} s, delay {sought.plant.delay[0]:.3g} s"


def _with_bandwidth(quick: Sequence[Sought], bandwidth: float) -> list[Sought]:
    found = parallel_map(lambda sought: with_bandwidth(sought, bandwidth), quick)
    if None in found:
        slowest = min(quick, key=lambda s: s.bandwidth)
        possible = float(f"{0.99 * slowest.bandwidth:.2g}")
        raise UsageError(
            f"no gains have a bandwidth of {bandwidth:.3g} rad/s at {slowest.plant.speed:.3g} m/s",
            found=f"{slowest.bandwidth:.3g} rad/s there, bound by {slowest.binds}; {_path(slowest)}",
            hint=f"`--bandwidth {possible:g}rad/s` is possible at all of these speeds",
        )
    return [sought for sought in found if sought is not None]


def _no_worse_than_one(rows: Sequence[Sought], places: Sequence[Place]) -> list[Sought]:
    """Return the rows; where the best constant gain is better at a speed, the gains come from a search that starts at it."""
    if len(rows) == 1 or places[0].demand.largest:
        return list(rows)
    one = best_constant(multiples_of([s.found.gains for s in rows]), places)

    def better_of(i: int) -> Sought:
        place, found = places[i], places[i].outcome(one)
        if not place.outcome(rows[i].found.gains).worse_than(found, place.demand):
            return rows[i]
        better = improved(place, one)
        gains = one if place.outcome(better).worse_than(found, place.demand) else better
        return replace(rows[i], found=replace(rows[i].found, gains=gains), binds=AS_THE_CONSTANT)

    return parallel_map(better_of, range(len(rows)))
