"""What gains come to at one speed: the one objective by which rows are designed and a constant gain is compared with them.

Requirements come first: the estimate has the damping, margin, fin and overshoot asked; then 95 % of the draws of its errors leave
half of the margin and come to rest from the step. Of gains that lack none of these, those are better that settle sooner, as
long as they settle later than asked; of those that settle alike, the ones that ask for less fin. So nothing is weighed against
anything else.

The time to settle is the mean of those in corridors of 4 to 6 % of the step, which a flight that is off by 1 % may leave: unlike
that of 5 % alone it does not jump by half a swing where an overshoot touches the corridor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, log
from typing import Annotated

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Key, Number
from fieldsid.schedule.controller import HELD_SHARE, Gains, PlantResponse, margins, margins_of, plant_response, worst_of
from fieldsid.schedule.flown.response import (
    FLIGHT_ERROR_SHARE,
    LIMIT_CYCLE_SHARE,
    SETTLING_BAND,
    Flight,
    Pace,
    about_rest,
    fly,
    full_bandwidth,
    overshoot,
    pace_of,
    settling,
    swing,
)
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.record import Row
from fieldsid.schedule.search.formulas import bandwidth_of
from fieldsid.schedule.wish import QUICKEST, Wish, overshoot_of

DRAWS_MARGIN_SHARE = 0.5
"""Share of the wished phase margin that a draw of the errors has to leave: the estimate has all of it."""
SEARCHED_RAD_S = np.geomspace(5e-3, 100.0, 240)
"""Coarser than the margins' own grid: it is interpolated between, and the row found is checked on the fine one."""
ROUNDING = 1e-3
"""What is lacked of a requirement that counts as met, and to how much of an e-fold the least is found: gains to a thousandth."""
BETTER_SHARE = 0.01
"""Gains are better than others where they settle sooner, or ask for less fin, by more than this."""
FLOWN_TIMES, LEAST_SHARE = 25.0, 1.0 / 3.0
"""A step is flown for so many times 1/bandwidth of the full fin: within this share of what its pace has and all of that."""
ANSWER_TIMES = 3.0
"""And for so many times the settling that is asked."""
MOST_ERROR = 3.0
"""Steps of error at which a response counts as lost: what diverges is not later than that."""
FORBIDDEN = 100.0
"""Cost of what lacks a requirement: the log of no time in s, of no gain and of no share of a fin comes near it."""


@dataclass(frozen=True, slots=True)
class Demand:
    """What gains have to leave: damping of the estimate's poles, phase margin (deg) of the estimate, the step (rad) flown.

    The step may ask for `fin_use` of `fin_limit` (rad), the estimate may overshoot by `own_overshoot` and 95 % of the draws by
    `draws_overshoot`, as shares. It is flown at `pace`, and is to settle within `settling` s; with `largest` the largest gain
    that leaves all that is the best, as a formula has it. The formula's poles are to have a `bandwidth` (rad/s), if one is asked.
    """

    damping: float
    phase_margin_deg: float
    step: float
    own_overshoot: float
    draws_overshoot: float
    fin_limit: float
    fin_use: float
    pace: Pace
    settling: float = QUICKEST
    largest: bool = False
    bandwidth: float | None = None

    def fin_of(self, gains: Gains) -> float:
        """Return the share of the fin's limit that the step asks for."""
        return abs(gains.kp) * self.step / self.fin_limit


@dataclass(frozen=True, slots=True)
class Outcome:
    """What gains come to: settling (s), the share of the fin that the step asks for, |kp|, and what is lacked, as shares.

    `own` is what the estimate lacks of damping, phase margin, fin, bandwidth and overshoot, `drawn` what the draws do of phase
    margin, overshoot and rest.
    """

    own: tuple[float, ...]
    drawn: tuple[float, ...]
    settled: Annotated[Number, Key("The time to settle that the rows are designed by.", "answer_s")]
    fin: Annotated[Number, Key("The share of the fin's limit that the step asks for.", "fin_use")]
    kp: float

    @property
    def serves(self) -> bool:
        """Whether nothing is lacked."""
        return sum(self.own) <= ROUNDING and sum(self.drawn) <= ROUNDING

    def cost(self, demand: Demand) -> float:
        """Return what of two gains at one speed is smaller for the better, as long as it is not the fin that tells them apart."""
        if sum(self.own) > ROUNDING:
            return 2.0 * FORBIDDEN + sum(self.own)
        if sum(self.drawn) > ROUNDING:
            return FORBIDDEN + sum(self.drawn)
        return self._late(demand)

    def worse_than(self, other: Outcome, demand: Demand) -> bool:
        """Return whether another is better by more than BETTER_SHARE in the first thing that tells them apart."""
        mine = (sum(self.own), sum(self.drawn), self._late(demand), 0.0 if demand.largest else log(self.fin))
        its = (sum(other.own), sum(other.drawn), other._late(demand), 0.0 if demand.largest else log(other.fin))
        first = next((a - b for a, b in zip(mine, its, strict=True) if abs(a - b) > BETTER_SHARE), 0.0)
        return first > 0.0

    def _late(self, demand: Demand) -> float:
        return -log(self.kp) if demand.largest else log(max(self.settled, demand.settling, 1e-6))


def demand_of(family: LinearPlant, wish: Wish, fin_limit: float, answer: float = QUICKEST) -> Demand:
    """Return what a wish asks of a plant whose fin is limited to +/-fin_limit rad; `answer` (s) is what all speeds settle in."""
    step, damping = wish.step_of(family.axis), wish.damped
    drawn = overshoot_of(min(damping, DRAWS_MARGIN_SHARE * wish.phase_margin_deg / 100.0))
    own = inf if wish.overshoot is None else wish.overshoot
    pace = pace_of(family, fin_limit, step)
    wanted = FLOWN_TIMES / max(full_bandwidth(family, fin_limit, step), FLOWN_TIMES / pace.flight)
    pace = replace(pace, flight=max(wanted, LEAST_SHARE * pace.flight, ANSWER_TIMES * answer))
    # poles other than the designed pair (an integrator's, the fin's) may be a little less damped, never below half
    floor = damping if wish.kind == "p" and damping < 1.0 else min(damping, 1.0) * 0.8
    return Demand(
        floor,
        wish.phase_margin_deg,
        step,
        own,
        min(drawn, own),
        fin_limit,
        wish.most_fin,
        pace,
        answer,
        wish.is_formula or wish.bandwidth is not None,
    )


@dataclass(frozen=True)
class Place:
    """A plant with what is asked of it: where gains are tried."""

    plant: LinearPlant
    demand: Demand

    def __reduce__(self) -> tuple[type[Place], tuple[LinearPlant, Demand]]:
        return Place, (self.plant, self.demand)  # what is known of it is found again rather than sent

    @cached_property
    def known(self) -> PlantResponse:
        """The plant's response, which no gains change."""
        return plant_response(self.plant, SEARCHED_RAD_S)

    def one(self) -> Place:
        """Return the estimate alone."""
        return Place(self.plant.one(), self.demand)

    def settled_within(self, answer: float) -> Place:
        """Return the same with another settling (s) asked for, flown no shorter than that takes."""
        pace = replace(self.demand.pace, flight=max(self.demand.pace.flight, ANSWER_TIMES * answer))
        return Place(self.plant, replace(self.demand, settling=answer, pace=pace))

    def with_bandwidth(self, bandwidth: float) -> Place:
        """Return the same with a bandwidth (rad/s) asked for in place of the largest gain."""
        return Place(self.plant, replace(self.demand, largest=False, bandwidth=bandwidth))

    def linear_lacks(self, gains: Gains) -> tuple[list[float], list[float]]:
        """Return `own` and `drawn` of an outcome as far as they need no flight."""
        demand, found = self.demand, margins_of(self.known, gains)
        asked, phase = demand.phase_margin_deg, found.phase_deg
        own = [
            max(demand.damping - float(found.damping[0]), 0.0) / demand.damping,
            max(asked - float(phase[0]), 0.0) / asked,
            max(demand.fin_of(gains) / demand.fin_use - 1.0, 0.0),
            0.0 if demand.bandwidth is None else abs(bandwidth_of(self.plant.one(), gains) / demand.bandwidth - 1.0),
            0.0,
        ]
        return own, [_of_draws((DRAWS_MARGIN_SHARE * asked - phase) / asked) if self.plant.count > 1 else 0.0, 0.0, 0.0]

    @cached_property
    def _tried(self) -> dict[Gains, Outcome]:
        return {}

    def outcome(self, gains: Gains) -> Outcome:
        """Return what gains come to: flown only where the estimate's poles and margins are as asked, and once."""
        if gains not in self._tried:
            self._tried[gains] = self._outcome(gains)
        return self._tried[gains]

    def _outcome(self, gains: Gains) -> Outcome:
        demand, (own, drawn) = self.demand, self.linear_lacks(gains)
        fin, kp = demand.fin_of(gains), abs(gains.kp)
        if sum(own) > ROUNDING:
            return Outcome(tuple(own), tuple(drawn), inf, fin, kp)
        time, angle = self.step(gains)
        moved = about_rest(angle, demand.step)
        own[4] = max(float(overshoot(angle, demand.step)[0]) - demand.own_overshoot, 0.0)
        drawn[1] = _of_draws(overshoot(moved, demand.step) - demand.draws_overshoot)
        drawn[2] = _of_draws(swing(angle, demand.step) - LIMIT_CYCLE_SHARE)
        settled = smooth_settling(time, moved, demand.step)
        settled[0] = smooth_settling(time, angle[:, :1], demand.step)[0]  # its trim is known: what it has not reached is late
        return Outcome(tuple(own), tuple(drawn), max(float(settled[0]), worst_of(settled, most=True)), fin, kp)

    def step(self, gains: Gains) -> tuple[FloatArray, FloatArray]:
        """Return time (t,) and angle (t, d) of the step flown with gains, the trim of the estimate counted out."""
        plant, demand = self.plant, self.demand
        row = Row(plant.speed, gains, -float(plant.offset[0]), plant.reference_gain, demand.fin_limit)
        steps = fly(plant, (row,), Flight(demand.pace.flight, demand.pace.step, reference=demand.step))
        return steps.time, steps.angle

    def held(self, gains: Gains) -> tuple[float, float]:
        """Return the share of the draws that come to rest with the margin asked of draws, and the settling (s) of 95 %."""
        time, angle = self.step(gains)
        demand, moved = self.demand, about_rest(angle, self.demand.step)
        rests = (overshoot(moved, demand.step) <= demand.draws_overshoot + ROUNDING) & (
            swing(angle, demand.step) <= LIMIT_CYCLE_SHARE + ROUNDING
        )
        asked = (DRAWS_MARGIN_SHARE - 2.0 * ROUNDING) * demand.phase_margin_deg
        damped = margins(self.plant, gains).phase_deg >= asked
        return float(np.mean(rests & damped)), worst_of(settling(time, moved, demand.step), most=True)


def smooth_settling(time: FloatArray, values: FloatArray, size: float) -> FloatArray:
    """Return the mean time (n,) s in which steps (t, n) of `size` settle in corridors from 4 to 6 % of it.

    What has not come there in the end counts as so many more flights as it is steps off: of two that are late, one is later.
    """
    off = np.nan_to_num(np.abs(values / size - 1.0), nan=inf, posinf=inf)
    left = np.maximum.accumulate(off[::-1], axis=0)[::-1]  # the most that is still to come
    low = SETTLING_BAND - FLIGHT_ERROR_SHARE
    outside = np.clip((left - low) / (2.0 * FLIGHT_ERROR_SHARE), 0.0, 1.0)
    still_off = np.clip(left[-1] - low, 0.0, MOST_ERROR)
    return np.asarray(outside.sum(axis=0) * float(time[1] - time[0]) + still_off * float(time[-1]))


def _of_draws(lacks: FloatArray) -> float:
    """Return what 95 % of the draws lack, (d,): the worst of them and their mean, each draw's at most a whole requirement.

    The worst is a corner that the least of a cost keeps to; where it cannot be met the mean still tells more from fewer draws.
    """
    held = np.sort(np.clip(np.where(np.isfinite(lacks), lacks, np.sign(lacks)), 0.0, 1.0))
    best = held[: int(np.ceil(HELD_SHARE * held.size - 1e-9))]
    return float(best[-1] + np.mean(best))
