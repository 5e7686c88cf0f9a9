"""Gains at one speed for a chosen controller: by formula, with the bandwidth and damping that `search` finds.

The estimate has the required damping and phase margin; 95 % of the draws of its errors have at least half of the margin and
settle after the step, simulated with the limits of the fin, the loss of speed and the nonlinear damping. P and PI have the
largest gain that meets these requirements, unless a settling time or a bandwidth is required. The limit of the bandwidth
(`binds`) is the fin, the required response, or the requirement that a slightly larger bandwidth would violate. The feed-forward
is -delta_r0 (-delta_s0 in pitch, plus c23/d2 of the reference).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import degrees

import numpy as np

from fieldsid.errors import ModelError
from fieldsid.rounding import number
from fieldsid.schedule.controller import FREQUENCY_GRID_RAD_S, HELD_SHARE, Gains, margins, worst_of
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.record import Row
from fieldsid.schedule.search.formulas import bandwidth_of
from fieldsid.schedule.search.objective import BETTER_SHARE, DRAWS_MARGIN_SHARE, ROUNDING, Demand, Place, demand_of
from fieldsid.schedule.search.optimum import Found, Search
from fieldsid.schedule.wish import PROPORTIONAL, QUICKEST, Wish

LEAST_HELD = 0.5
"""P and PI that serve a smaller share of the draws are refused: no proportional gain stabilises an unstable hull."""
OPTIONS = {"kind": "--controller {}", "damping": "--damping {:g}", "phase_margin_deg": "--phase-margin {:g}"}
DEPTH_PHASE_MARGIN_DEG = 60.0
"""Phase margin of the depth loop around the pitch loop, for hardly any overshoot but that by the pitch limit."""


@dataclass(frozen=True, slots=True)
class Sought:
    """Gains found for a plant by its draws, or by its estimate only where no gains serve the draws.

    `binds` names the limit of the bandwidth; `slowed` is the bandwidth over that which the fin allows, below one where lag,
    delay, margin or the draws are the limit.
    """

    plant: LinearPlant
    search: Search
    found: Found
    binds: str
    slowed: float

    @property
    def settled(self) -> float:
        """The settling time (s) of the step, the longer of the estimate's and that of 95 % of the draws."""
        return self.found.outcome.settled

    @property
    def bandwidth(self) -> float:
        """The bandwidth (rad/s) of the formula's poles."""
        return bandwidth_of(self.plant.one(), self.found.gains)

    @property
    def step(self) -> float:
        """The simulated step (rad)."""
        return self.search.place.demand.step


def design_gains(plant: LinearPlant, wish: Wish, fin_limit: float, answer: float = QUICKEST) -> Sought:
    """Return the gains of one speed for the required bandwidth or settling time `answer` (s), the quickest where none serve."""
    quick = quickest(plant, wish, fin_limit)
    if wish.bandwidth is not None:
        return with_bandwidth(quick, wish.bandwidth) or quick
    return answering(quick, answer, f"settling {answer:.3g} s") if answer > QUICKEST else quick


def quickest(plant: LinearPlant, wish: Wish, fin_limit: float) -> Sought:
    """Return the quickest gains that serve 95 % of a plant's draws; raises ModelError where none serve the estimate.

    P and PI that serve fewer than half of the draws are refused as well. With a rate feedback, where no gains serve 95 % of the
    draws, the gains are those for the estimate: a compromise would serve neither.
    """
    family = plant.distinct()
    if wish.kind in PROPORTIONAL and family.slow_damping[0] <= 0:
        raise _unstable(family, wish, fin_limit)
    found, search = _found(family, wish, fin_limit), _search(family, wish, fin_limit)
    if found is None:
        raise _refusal(family, wish, fin_limit)
    if search.place.draws_served(found.gains)[0] < HELD_SHARE and (alone := _found(family.one(), wish, fin_limit)) is not None:
        found, search = alone, _search(family.one(), wish, fin_limit)
    return Sought(plant, search, found, bound_by(search, found), found.share)


def answering(quick: Sought, answer: float, says: str) -> Sought:
    """Return the gains of least fin that settle within `answer` s, with `says` as their limit; the quickest if nearly as slow."""
    if quick.settled >= (1.0 - BETTER_SHARE) * answer:
        return quick
    search = replace(quick.search, place=quick.search.place.settled_within(answer))
    found = search.least_fin(search.at(quick.found.share, quick.found.more))
    return replace(quick, search=search, found=found, binds=says, slowed=1.0)


def with_bandwidth(quick: Sought, bandwidth: float) -> Sought | None:
    """Return the gains of a bandwidth (rad/s) with the best damping, None where they violate a requirement."""
    search = replace(quick.search, place=quick.search.place.with_bandwidth(bandwidth))
    found = search.damped(quick.found.share * bandwidth / quick.bandwidth)
    if not found.outcome.serves:
        return None
    return replace(quick, search=search, found=found, binds=f"bandwidth {bandwidth:.3g} rad/s", slowed=1.0)


def row_of(sought: Sought, *, depth: bool, supported: bool) -> Row:
    """Return the row of found gains with the margins and the settling time over the draws.

    `depth` adds the depth loop; `supported` says whether the data contain this speed.
    """
    plant, gains, demand = sought.plant, sought.found.gains, sought.search.place.demand
    family = plant.distinct()
    served, settling = Place(family, demand).draws_served(gains)
    phase, gain, delay = margins(plant, gains).worst()
    return Row(
        plant.speed, gains, -float(plant.offset[0]), plant.reference_gain, demand.fin_limit,
        _depth_gain(family, gains) if depth else 0.0, supported, sought.slowed,
        phase, gain, delay, served, settling, sought.binds, demand.fin_of(gains),
    )  # fmt: skip


def _depth_gain(family: LinearPlant, gains: Gains) -> float:
    """Return the gain from depth to pitch, rad/m, with which the cascade u k T/s has its phase margin for 95 % of the draws.

    T is the closed pitch loop from its reference, with the lag of the path; the crossover is where it lags by 90 deg less the
    margin.
    """
    omega = FREQUENCY_GRID_RAD_S
    by_reference = gains.kp + gains.ki / (1j * omega) + family.reference_gain
    hull = family.response(omega)
    path = 1.0 / (1.0 + 1j * omega * family.path_lag)
    closed = path * hull * by_reference[None, :] / (1.0 + hull * gains.response(omega)[None, :])
    phase = np.degrees(np.unwrap(np.angle(closed), axis=1))
    first = np.argmax(phase <= DEPTH_PHASE_MARGIN_DEG - 90.0, axis=1)
    reached = np.take_along_axis(np.abs(closed), first[:, None], axis=1)[:, 0]
    return worst_of(omega[first] / (family.speed * reached), most=False)


def _search(family: LinearPlant, wish: Wish, fin_limit: float) -> Search:
    return Search(Place(family, demand_of(family, wish, fin_limit)), wish)


def _found(family: LinearPlant, wish: Wish, fin_limit: float) -> Found | None:
    """Return the quickest gains; None where they do not serve the estimate, or with P and PI fewer than half of the draws."""
    search = _search(family, wish, fin_limit)
    found = search.quickest()
    if sum(found.outcome.own) > ROUNDING:
        return None
    return None if wish.kind in PROPORTIONAL and search.place.draws_served(found.gains)[0] < LEAST_HELD else found


def _unstable(family: LinearPlant, wish: Wish, fin_limit: float) -> ModelError:
    growth = float(family.growth[0])
    grows = f", a deviation doubles every {np.log(2) / growth:.2g} s" if growth > 0 else ""
    return ModelError(
        f"the plant is unstable at {family.speed:.3g} m/s, and a proportional gain alone cannot hold it",
        found=f"damping {family.slow_damping[0]:.3g} 1/s{grows}{_of_draws(family)}",
        hint=_remedy(family, wish, fin_limit),
    )


def _of_draws(family: LinearPlant) -> str:
    unstable = int(np.count_nonzero(family.growth > 0.0))
    return f"; unstable by {unstable} of {family.count} draws of the errors" if unstable and family.count > 1 else ""


def _refusal(family: LinearPlant, wish: Wish, fin_limit: float) -> ModelError:
    one = family.one()
    whom = "" if family.count == 1 or wish.kind not in PROPORTIONAL else " for half of the draws of the models' errors"
    damping = f"damping {wish.damped:.3g}" + ("" if wish.overshoot is None else f", overshoot {100.0 * wish.overshoot:g} %")
    found = f"damping {one.slow_damping[0]:.3g} 1/s, fin lag {one.lag[0]:.3g} s, delay {one.delay[0]:.3g} s"
    return ModelError(
        f"no {wish.kind} gain keeps {damping} and {wish.phase_margin_deg:g} deg at {family.speed:.3g} m/s{whom}",
        found=f"{found}{_of_draws(family)}",
        hint=_remedy(family, wish, fin_limit),
    )


def _remedy(family: LinearPlant, wish: Wish, fin_limit: float) -> str:
    """Return the hint with command-line options for which there are gains at this speed; empty if none of the usual ones helps.

    Every other controller is a special case of PD or loses phase by an integral: without PD gains for the loosest requirements
    there are none.
    """
    damping, margin = wish.damped, wish.phase_margin_deg
    loosest, *others = (
        replace(wish, kind="pd", damping=min(0.3, damping), phase_margin_deg=min(20.0, margin)),
        replace(wish, kind="pd"),
        *(replace(wish, damping=d) for d in (0.5, 0.3) if d < damping),
        *(replace(wish, phase_margin_deg=p) for p in (30.0, 20.0) if p < margin),
        replace(wish, kind="pd", damping=min(0.5, damping), phase_margin_deg=min(30.0, margin)),
    )
    if _found(family.one(), loosest, fin_limit) is None:
        return ""
    for other in others:
        if other == wish or (other.kind in PROPORTIONAL and family.slow_damping[0] <= 0):
            continue
        # with a rate feedback gains are refused only where they do not serve the estimate
        if _found(family if other.kind in PROPORTIONAL else family.one(), other, fin_limit) is not None:
            changed = (option.format(getattr(other, n)) for n, option in OPTIONS.items() if getattr(other, n) != getattr(wish, n))
            return f"at this speed there is one with `{' '.join(changed)}`"
    return ""


A_LITTLE_MORE = 1.03


def bound_by(search: Search, found: Found) -> str:
    """Return the limit of the bandwidth of the quickest gains, in words."""
    demand, wish = search.place.demand, search.wish
    if found.share >= 1.0 - 2.0 * ROUNDING:
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
    """Return the requirements in words, in the order of `Outcome.own` and `Outcome.drawn`."""
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
