"""The objective of gains at one speed, by which rows are designed and a constant gain is compared with them.

The order is lexicographic, without weights. First the requirements on the estimate: damping, margin, fin and overshoot; then
those on 95 % of the draws of its errors: half of the margin, and a settled response to the step. Of gains that meet all
requirements those are better that settle sooner, down to the required time; of gains with equal settling times those that use
less fin.

The settling time is the mean over corridors of 4 to 6 % of the step, as a real response may be off by 1 %: unlike that of 5 % it
does not jump by half a period where an overshoot touches the corridor.
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
    FLOWN_TIMES,
    LIMIT_CYCLE_SHARE,
    SETTLING_BAND,
    SIDES,
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
"""Share of the required phase margin that a draw of the errors must have; the estimate must have all of it."""
SEARCHED_RAD_S = np.geomspace(5e-3, 100.0, 240)
"""Frequencies of the search, coarser than the grid of `margins`, on which the final row is evaluated."""
ROUNDING = 1e-3
"""Shortfall at which a requirement counts as met, and tolerance of the search in log units: gains to a thousandth."""
BETTER_SHARE = 0.01
"""Relative difference of settling time or fin use from which on gains are better than others."""
LEAST_SHARE = 1.0 / 3.0
"""Least simulated time of a step over that of the pace."""
ANSWER_TIMES = 3.0
"""Least simulated time of a step over the required settling time."""
MOST_ERROR = 3.0
"""Largest final error that counts, in steps: a response that diverges has this one."""
FORBIDDEN = 100.0
"""Cost of a violated requirement, far above the logarithm of any settling time (s), gain or share of the fin."""


@dataclass(frozen=True, slots=True)
class Demand:
    """The requirements on gains: damping of the estimate's poles, phase margin (deg) of the estimate, the simulated step (rad).

    The step may use the share `fin_use` of `fin_limit` (rad); the estimate may overshoot by `own_overshoot` and 95 % of the draws
    by `draws_overshoot`, as shares. The step is simulated at `pace` and must settle within `settling` s. With `largest` the best
    gain is the largest that meets the requirements, as for a formula. `bandwidth` (rad/s) is that of the formula's poles, or
    None.
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
        """Return the share of the fin limit that the step uses."""
        return abs(gains.kp) * self.step / self.fin_limit


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of gains: settling time (s), share of the fin limit that the step uses, |kp|, and relative shortfalls.

    `own` are the shortfalls of the estimate in damping, phase margin, fin, bandwidth and overshoot, `drawn` those of the draws in
    phase margin, overshoot and oscillation.
    """

    own: tuple[float, ...]
    drawn: tuple[float, ...]
    settled: Annotated[Number, Key("The time to settle that the rows are designed by.", "answer_s")]
    fin: Annotated[Number, Key("The share of the fin's limit that the step asks for.", "fin_use")]
    kp: float

    @property
    def serves(self) -> bool:
        """Whether all requirements are met."""
        return sum(self.own) <= ROUNDING and sum(self.drawn) <= ROUNDING

    def cost(self, demand: Demand) -> float:
        """Return the cost, which is smaller for better gains at one speed; it does not contain the fin use."""
        if sum(self.own) > ROUNDING:
            return 2.0 * FORBIDDEN + sum(self.own)
        if sum(self.drawn) > ROUNDING:
            return FORBIDDEN + sum(self.drawn)
        return self._late(demand)

    def worse_than(self, other: Outcome, demand: Demand) -> bool:
        """Return whether another outcome is better by more than BETTER_SHARE in the first criterion in which they differ."""
        this = (sum(self.own), sum(self.drawn), self._late(demand), 0.0 if demand.largest else log(self.fin))
        that = (sum(other.own), sum(other.drawn), other._late(demand), 0.0 if demand.largest else log(other.fin))
        first = next((a - b for a, b in zip(this, that, strict=True) if abs(a - b) > BETTER_SHARE), 0.0)
        return first > 0.0

    def _late(self, demand: Demand) -> float:
        return -log(self.kp) if demand.largest else log(max(self.settled, demand.settling, 1e-6))


def demand_of(family: LinearPlant, wish: Wish, fin_limit: float, answer: float = QUICKEST) -> Demand:
    """Return the requirements of a wish on a plant with a fin within +/-fin_limit rad and a common settling time `answer` s."""
    step, damping = wish.step_of(family.axis), wish.damped
    drawn = overshoot_of(min(damping, DRAWS_MARGIN_SHARE * wish.phase_margin_deg / 100.0))
    own = inf if wish.overshoot is None else wish.overshoot
    pace = pace_of(family, fin_limit, step)
    wanted = FLOWN_TIMES / max(full_bandwidth(family, fin_limit, step), FLOWN_TIMES / pace.flight)
    pace = replace(pace, flight=max(wanted, LEAST_SHARE * pace.flight, ANSWER_TIMES * answer))
    # other poles than the designed pair (of an integrator or the fin) may have a slightly lower damping, not below half
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
    """A plant with its requirements, on which gains are evaluated."""

    plant: LinearPlant
    demand: Demand

    def __reduce__(self) -> tuple[type[Place], tuple[LinearPlant, Demand]]:
        return Place, (self.plant, self.demand)  # cached properties are computed again in a worker and not sent to it

    @cached_property
    def response(self) -> PlantResponse:
        """The frequency response of the plant."""
        return plant_response(self.plant, SEARCHED_RAD_S)

    def one(self) -> Place:
        """Return the place with the estimate only."""
        return Place(self.plant.one(), self.demand)

    def settled_within(self, answer: float) -> Place:
        """Return the place with another required settling time (s), and a simulated time that suffices for it."""
        pace = replace(self.demand.pace, flight=max(self.demand.pace.flight, ANSWER_TIMES * answer))
        return Place(self.plant, replace(self.demand, settling=answer, pace=pace))

    def with_bandwidth(self, bandwidth: float) -> Place:
        """Return the place with a required bandwidth (rad/s) in place of the largest gain."""
        return Place(self.plant, replace(self.demand, largest=False, bandwidth=bandwidth))

    def linear_shortfalls(self, gains: Gains) -> tuple[list[float], list[float]]:
        """Return `own` and `drawn` of an outcome as far as they need no simulation; the others are zero."""
        demand, found = self.demand, margins_of(self.response, gains)
        required, phase = demand.phase_margin_deg, found.phase_deg
        own = [
            max(demand.damping - float(found.damping[0]), 0.0) / demand.damping,
            max(required - float(phase[0]), 0.0) / required,
            max(demand.fin_of(gains) / demand.fin_use - 1.0, 0.0),
            0.0 if demand.bandwidth is None else abs(bandwidth_of(self.plant.one(), gains) / demand.bandwidth - 1.0),
            0.0,
        ]
        margin = _of_draws((DRAWS_MARGIN_SHARE * required - phase) / required) if self.plant.count > 1 else 0.0
        return own, [margin, 0.0, 0.0]

    @cached_property
    def _outcomes(self) -> dict[Gains, Outcome]:
        return {}

    def outcome(self, gains: Gains) -> Outcome:
        """Return the outcome of gains, cached; simulated only where poles and margins of the estimate meet the requirements."""
        if gains not in self._outcomes:
            self._outcomes[gains] = self._outcome(gains)
        return self._outcomes[gains]

    def _outcome(self, gains: Gains) -> Outcome:
        demand, (own, drawn) = self.demand, self.linear_shortfalls(gains)
        fin, kp = demand.fin_of(gains), abs(gains.kp)
        if sum(own) > ROUNDING:
            return Outcome(tuple(own), tuple(drawn), inf, fin, kp)
        time, angle = self.step(gains)
        about = about_rest(angle, demand.step, gains)
        own[4] = max(float(overshoot(angle[..., 0], demand.step).max()) - demand.own_overshoot, 0.0)
        drawn[1] = _of_draws(overshoot(about, demand.step).max(axis=0) - demand.draws_overshoot)
        drawn[2] = _of_draws(swing(angle, demand.step).max(axis=0) - LIMIT_CYCLE_SHARE)
        settled = smooth_settling(time, about, demand.step).max(axis=0)
        return Outcome(tuple(own), tuple(drawn), max(float(settled[0]), worst_of(settled, most=True)), fin, kp)

    def step(self, gains: Gains) -> tuple[FloatArray, FloatArray]:
        """Return time (t,) s and angle (t, 2, d) rad of the simulated step to both sides, that to the negative one mirrored.

        The feed-forward cancels the trim of the estimate, and leaves less of the fin to one side than to the other.
        """
        plant, demand = self.plant, self.demand
        row = Row(plant.speed, gains, -float(plant.offset[0]), plant.reference_gain, demand.fin_limit)
        sides = [fly(plant, (row,), Flight(demand.pace.flight, demand.pace.step, reference=s * demand.step)) for s in SIDES]
        return sides[0].time, np.stack([s * steps.angle for s, steps in zip(SIDES, sides, strict=True)], axis=1)

    def draws_served(self, gains: Gains) -> tuple[float, float]:
        """Return the share of the draws that meet the requirements on draws, and the settling time (s) of 95 % of the draws."""
        time, angle = self.step(gains)
        demand, about = self.demand, about_rest(angle, self.demand.step, gains)
        rests = (overshoot(about, demand.step) <= demand.draws_overshoot + ROUNDING) & (
            swing(angle, demand.step) <= LIMIT_CYCLE_SHARE + ROUNDING
        )
        required = (DRAWS_MARGIN_SHARE - 2.0 * ROUNDING) * demand.phase_margin_deg
        has_margin = margins(self.plant, gains).phase_deg >= required
        settled = settling(time, about, demand.step).max(axis=0)
        return float(np.mean(rests.all(axis=0) & has_margin)), worst_of(settled, most=True)


def smooth_settling(time: FloatArray, values: FloatArray, size: float) -> FloatArray:
    """Return the mean settling time (n,) s of steps (t, n) of `size` over corridors from 4 to 6 % of it.

    A response that ends outside its corridor has its final error, in steps, times the simulated time added, so that of two
    responses that do not settle the one with the larger error is later.
    """
    error = np.nan_to_num(np.abs(values / size - 1.0), nan=inf, posinf=inf)
    largest_later = np.maximum.accumulate(error[::-1], axis=0)[::-1]
    low = SETTLING_BAND - FLIGHT_ERROR_SHARE
    outside = np.clip((largest_later - low) / (2.0 * FLIGHT_ERROR_SHARE), 0.0, 1.0)
    final = np.clip(largest_later[-1] - low, 0.0, MOST_ERROR)
    return np.asarray(outside.sum(axis=0) * float(time[1] - time[0]) + final * float(time[-1]))


def _of_draws(shortfalls: FloatArray) -> float:
    """Return the worst plus the mean of the shortfalls (d,) over the best 95 % of the draws, each limited to 0 .. 1.

    The worst makes the minimum of the cost meet the requirement; where that is impossible the mean still orders gains by how many
    draws meet it.
    """
    ordered = np.sort(np.clip(np.where(np.isfinite(shortfalls), shortfalls, np.sign(shortfalls)), 0.0, 1.0))
    best = ordered[: int(np.ceil(HELD_SHARE * ordered.size - 1e-9))]
    return float(best[-1] + np.mean(best))
