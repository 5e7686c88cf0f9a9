"""What binds the gains of a row: the fin, the answer asked, or the requirement that a little more bandwidth would not keep."""

from __future__ import annotations

from math import degrees

from fieldsid.rounding import number
from fieldsid.schedule.search.objective import DRAWS_MARGIN_SHARE, Demand
from fieldsid.schedule.search.optimum import PLACE_ROUNDING, Found, Search
from fieldsid.schedule.wish import Wish

A_LITTLE_MORE = 1.03


def bound_by(search: Search, found: Found) -> str:
    """Return what keeps gains that were sought as quick as may be from more bandwidth."""
    demand, wish = search.place.demand, search.wish
    if found.share >= 1.0 - 2.0 * PLACE_ROUNDING:
        return (
            f"damping {number(wish.damped, 3)}" if demand.fin_use > demand.fin_of(found.gains) * A_LITTLE_MORE else _fin(demand)
        )
    share = A_LITTLE_MORE * found.share
    outcome = search.at(share, max(found.more, search.needed(share))).outcome
    lacks = dict(zip(_words(demand, wish), (*outcome.own, *outcome.drawn), strict=True))
    most = max(lacks, key=lambda name: lacks[name])
    return most if lacks[most] > 0.0 else "the step itself: more gain settles no sooner"


def _fin(demand: Demand) -> str:
    share = "" if demand.fin_use == 1.0 else f"{number(100.0 * demand.fin_use, 3)} % of the "
    return f"{share}fin at {number(degrees(demand.step), 3)} deg"


def _words(demand: Demand, wish: Wish) -> list[str]:
    """Return what can be lacked, in the order of an outcome."""
    margin = demand.phase_margin_deg
    own = (f"damping {number(wish.damped, 3)}", f"phase margin {number(margin, 3)} deg", _fin(demand))
    over = (f"overshoot {number(100.0 * o, 3)} %" for o in (demand.own_overshoot, demand.draws_overshoot))
    (ours, theirs), half = over, number(DRAWS_MARGIN_SHARE * margin, 3)
    return [
        *own,
        "bandwidth",
        ours,
        f"phase margin {half} deg by the draws",
        f"{theirs} by the draws",
        "swing after the step by the draws",
    ]
