"""Verification of a schedule: margins and simulated steps over the uncertainty set, against the best constant gain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated

import numpy as np

from fieldsid.display import Brief, Plotted
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.records.keys import Key
from fieldsid.runtime.parallel_map import parallel_map
from fieldsid.schedule.check import READ_OFF, Check, StepCheck
from fieldsid.schedule.controller import HELD_SHARE, Gains, margins, worst_of
from fieldsid.schedule.dive_path import DivePath
from fieldsid.schedule.flown.response import (
    FLIGHT_ERROR_SHARE,
    LIMIT_CYCLE_SHARE,
    LONGER,
    SETTLING_BAND,
    SIDES,
    Flight,
    Pace,
    Steps,
    about_rest,
    disturbance_moment,
    fly,
    overshoot,
    pace_of,
    settling,
    steady_error,
    swing,
    tightest,
)
from fieldsid.schedule.linear_plant import PARTS, LinearPlant
from fieldsid.schedule.plants import Plants, models_plants, plants_of
from fieldsid.schedule.record import Row, Schedule
from fieldsid.schedule.rows import DESIGN_DRAWS, place_of
from fieldsid.schedule.rows import SEED as DESIGN_SEED
from fieldsid.schedule.search.objective import Place
from fieldsid.schedule.search.optimum import best_constant, multiples_of
from fieldsid.schedule.wish import STEP_ANGLE_RAD
from fieldsid.turning.model_error import MIN_COVERED_SHARE

VERIFY_DRAWS = 60
SEED = 77
STEPS_RAD = {
    Axis.YAW: (0.08726646259971647, STEP_ANGLE_RAD[Axis.YAW], 1.5707963267948966),
    Axis.PITCH: (0.03490658503988659, STEP_ANGLE_RAD[Axis.PITCH], 0.3490658503988659),
}
"""A small, the standard and a large step: 5, 20 and 90 deg of heading, 2, 10 and 20 deg of pitch."""
FIN_OFFSET_RAD = 0.05235987755982988
"""3 deg: the fin offset of a verification."""
AT_REST_SHARE = 0.5 * LIMIT_CYCLE_SHARE
DEPTH_STEP_M = 2.0
PITCH_LIMIT_RAD = STEPS_RAD[Axis.PITCH][-1]


@dataclass(frozen=True, slots=True, repr=False)
class FlownSet(Brief):
    """Simulations of the estimate at one speed (m/s): steps with the schedule and with the constant gain, the straight leg."""

    speed: float
    pace: Pace
    scheduled: tuple[Steps, Steps, Steps]
    constant: tuple[Steps, Steps, Steps]
    leg: Steps


@dataclass(frozen=True, slots=True, repr=False)
class Verification(Plotted):
    """Checks of the schedule and of the best constant gain at the same speeds; the constant row; the estimate's simulations."""

    schedule: Schedule
    scheduled: Annotated[tuple[Check, ...], Key("The schedule, at its rows and between.")]
    constant: Annotated[tuple[Check, ...], Key("One constant gain, at the same speeds.")]
    constant_row: Row
    flown: tuple[FlownSet, ...]
    draws: int
    spread: bool
    """Number of draws for each model, and whether they differ: a table may state no errors."""
    draws_of: str
    speed_lost: str
    disturbance: float
    """The distribution of the draws and the source of the loss of speed, in words; the rms of the models' disturbance moment in
    rad/s^2, zero without one."""
    unstable: bool
    """Whether the open-loop hull is unstable at one of the speeds and each speed has its own model: its settling then depends on
    effects that this model lacks."""
    tightest_flown: float
    """The largest curvature (1/m) in the runs, NaN where each speed has its own model."""
    actuator: Mapping[str, float | None]
    """Lag (s), delay (s), rate limit (rad/s) and latency (s) of the simulations."""
    worse: tuple[float, ...]
    """The speeds (m/s) of rows that are worse than the constant gain."""
    path: DivePath
    """The path from a pitch to the depth."""

    @property
    def extrapolated(self) -> tuple[float, float] | None:
        """The smallest step (rad) with a larger curvature than the runs, and their curvature over it, the least of all speeds."""
        for i, size in enumerate(steps_of(self.schedule)):
            covered = min(self.tightest_flown / max(tightest(flown.scheduled[i]), 1e-9) for flown in self.flown)
            if covered < MIN_COVERED_SHARE:
                return size, covered
        return None

    @property
    def unsaid(self) -> bool:
        """Whether overshoot and settling of the large step are not stated at one of the speeds."""
        return any(np.isnan(c.steps[2].settling) for c in self.scheduled)

    @property
    def worst(self) -> dict[str, float]:
        """The least margins and the most overshoot of the schedule, over speeds and 95 % of the draws."""
        return {name: read(self.weakest(name)) for name, (_, read) in READ_OFF.items()}

    def weakest(self, name: str) -> Check:
        """Return the check of the schedule in which the number `name` of READ_OFF is worst."""
        sign, read = READ_OFF[name]
        return min(self.scheduled, key=lambda c: sign * read(c))


def verify_schedule(
    schedule: Schedule,
    source: ParameterSource,
    *,
    draws: int = VERIFY_DRAWS,
    runs: Sequence[Run] = (),
) -> Verification:
    """Return the verification of a schedule on the parameters of its source, with their errors, at its rows and midway between.

    runs are those the models were fitted to: the vehicle in surge, sway and yaw is identified from them, unless the design found
    no gains for that vehicle.
    """
    of = plants_behind(schedule, source, runs)
    places = checked_speeds(schedule)
    plants = [of.family_at(speed, schedule.at(speed).fin_limit, draws, SEED + 10 * i) for i, (speed, _) in enumerate(places)]
    curvature, size = of.tightest_flown, schedule.wish.step_of(schedule.axis)
    paces = [pace_of(plant, schedule.at(plant.speed).fin_limit, size) for plant in plants]
    design_places = [_design_place(of, schedule, speed) for speed, _ in places]
    one = best_constant(multiples_of([r.gains for r in schedule.rows]), design_places)
    constant = replace(schedule.rows[0], gains=one)

    def checked(i: int) -> tuple[Check, Check, FlownSet]:
        speed, knot = places[i]
        flight = _Flight(plants[i], paces[i], schedule, of.noise_at(speed), curvature, design_places[i], knot=knot)
        own, steps, leg = _check(flight, schedule.at(speed), schedule.rows, constant=False)
        constant_here = replace(schedule.at(speed), gains=one)
        other, other_steps, _ = _check(flight, constant_here, (constant_here,), constant=True)
        return own, other, FlownSet(speed, paces[i], steps, other_steps, leg)

    scheduled, compared, flown = zip(*parallel_map(checked, list(range(len(places)))), strict=True)
    spread = any(bool((getattr(plants[0], name) != getattr(plants[0], name)[:1]).any()) for name in PARTS if name != "speed_loss")
    disturbance = max((m.noise.disturbance for m in source.models), default=0.0)
    unstable = of.belief is None and any(float(p.growth[0]) > 0.0 for p in plants)
    demands = [place.demand for place in design_places]
    triples = zip(scheduled, compared, demands, strict=True)
    worse = tuple(a.speed for a, b, demand in triples if a.knot and a.outcome.worse_than(b.outcome, demand))
    return Verification(
        schedule, scheduled, compared, constant, flown, draws, spread, of.draws_of, of.says, disturbance, unstable, curvature,
        of.actuator, worse, of.path,
    )  # fmt: skip


def plants_behind(schedule: Schedule, source: ParameterSource, runs: Sequence[Run]) -> Plants:
    """Return the plants for the verification of a schedule, as in its design: of the posterior of the runs, or of the models."""
    limits = schedule.stated_limits
    if schedule.provenance.get("belief_refused", False):
        return models_plants(source, limits, runs)
    return plants_of(source, limits, runs, schedule.provenance.get("length_m"))


def promised_step(schedule: Schedule, of: Plants, speed: float, start: float, size: float, held: float) -> StepCheck:
    """Return the check of one step from an angle (rad, negative to the negative side) at one speed (m/s), as in a verification.

    Its error at the end is that after `held` s, when an integral may have some left. A step from a pitch is one from zero with a
    fin that is off by what holds that pitch, and with a feed-forward that knows it.
    """
    limit = schedule.at(speed).fin_limit
    level = of.family_at(speed, limit, VERIFY_DRAWS, SEED)
    plant = replace(level, offset=level.offset - level.stiffness / level.slow_authority * start)
    rows = [replace(r, feed_forward=r.feed_forward + r.reference_gain * start) for r in schedule.rows]
    flown = _flown_to_rest(plant, rows, size, pace_of(plant, limit, schedule.wish.step_of(schedule.axis)))
    off = np.abs(steady_error(flown.angle[flown.time <= held], abs(size)))
    step = replace(_step(flown, abs(size), schedule.rows[0].gains), off=worst_of(off, most=True))
    return _without_unsupported(step, flown, plant, of.tightest_flown, can_hold=abs(plant.steady_fin(size)) < limit)


def steps_of(schedule: Schedule) -> tuple[float, float, float]:
    """Return the steps (rad) of a verification: small, that of the schedule's wish, and large."""
    small, _, large = STEPS_RAD[schedule.axis]
    return small, schedule.wish.step_of(schedule.axis), large


def _design_place(of: Plants, schedule: Schedule, speed: float) -> Place:
    """Return the place on which gains are evaluated by the objective, with the draws of the design."""
    limit = schedule.at(speed).fin_limit
    return place_of(of.at(speed, limit, DESIGN_DRAWS, DESIGN_SEED), schedule.wish, limit, schedule.answer.settling)


def checked_speeds(schedule: Schedule) -> list[tuple[float, bool]]:
    """Return the speeds of the rows (True) and those midway between them (False), rising."""
    knots = list(schedule.speeds)
    between = [0.5 * (a + b) for a, b in pairwise(knots)]
    return sorted([(s, True) for s in knots] + [(s, False) for s in between])


@dataclass(frozen=True, slots=True)
class _Flight:
    """The inputs of a check at one speed: plant and pace, schedule, the models' noise, the runs' largest curvature (1/m)."""

    plant: LinearPlant
    pace: Pace
    schedule: Schedule
    noise: Noise | None
    curvature: float
    place: Place
    knot: bool


def _check(flight: _Flight, row: Row, rows: Sequence[Row], *, constant: bool) -> tuple[Check, tuple[Steps, Steps, Steps], Steps]:
    plant, pace, schedule = flight.plant, flight.pace, flight.schedule
    found = margins(plant, row.gains)
    phase, gain, delay = (float(part[0]) for part in (found.phase_deg, found.gain_db, found.delay_s))
    least_phase, least_gain, least_delay = found.worst()
    sizes = steps_of(schedule)
    (small, usual, large), flights, others = zip(*(_to_both_sides(plant, rows, size, pace) for size in sizes), strict=True)
    fin = max(abs(plant.steady_fin(side * large.size)) for side in SIDES)
    tight = max(flights[2], others[2], key=tightest)
    large = _without_unsupported(large, tight, plant, flight.curvature, can_hold=fin < row.fin_limit)
    compensated = [replace(r, feed_forward=r.feed_forward - FIN_OFFSET_RAD) for r in rows]
    one = plant.one()
    bent, unknown = (fly(one, r, Flight(pace.flight, pace.step, offset=FIN_OFFSET_RAD)) for r in (compensated, rows))
    leg = fly(one, rows, Flight(pace.leg, pace.step, push=disturbance_moment(flight.noise, pace)))
    depth_over, depth_settled, depth_off = _depth(one, rows, pace) if schedule.depth else 3 * (float("nan"),)
    check = Check(
        row.speed, flight.knot, row.supported, constant, phase, gain, delay, least_phase, least_gain, least_delay,
        int(np.sum(found.phase_deg < 0.0)),
        (small, usual, large), float(min(np.min(flown.speed[:, 0]) for flown in (flights[2], others[2]))),
        float(steady_error(bent.angle, 0.0)[0]), float(steady_error(unknown.angle, 0.0)[0]),
        float(np.std(leg.angle[:, 0])), float(np.std(leg.fin[:, 0])), depth_over, depth_settled, depth_off, pace.leg,
        flight.place.outcome(row.gains),
    )  # fmt: skip
    return check, (flights[0].one(), flights[1].one(), flights[2].one()), leg


def _to_both_sides(plant: LinearPlant, rows: Sequence[Row], size: float, pace: Pace) -> tuple[StepCheck, Steps, Steps]:
    """Return the check of a step, and its flights to the side on which it settles later and to the other one."""
    flights = [_flown_to_rest(plant, rows, sign * size, pace) for sign in SIDES]
    sides = sorted(
        ((_step(flown, size, rows[0].gains), flown) for flown in flights),
        key=lambda side: (side[0].settling, side[0].off),
        reverse=True,
    )
    (later, late), (other, early) = sides
    worse = {
        n: max(getattr(later, n), getattr(other, n)) for n in ("overshoot", "overshoot_most", "settling_most", "swing", "off")
    }
    return replace(later, **worse), late, early


def _flown_to_rest(plant: LinearPlant, rows: Sequence[Row], size: float, pace: Pace) -> Steps:
    """Return the simulation of a step, mirrored where `size` (rad) is negative.

    It is repeated over a longer time if it has not settled, as a slow loop then does.
    """
    for times in LONGER:
        flight = fly(plant, rows, Flight(times * pace.flight, pace.step, reference=size))
        has_settled = np.isfinite(settling(flight.time, flight.angle[:, :1], size)[0])
        if has_settled and worst_of(swing(flight.angle, size), most=True) <= AT_REST_SHARE:
            break
    return flight.mirrored() if size < 0.0 else flight


def _step(flown: Steps, size: float, gains: Gains) -> StepCheck:
    about, off = about_rest(flown.angle, size, gains), np.abs(steady_error(flown.angle, size))
    over, oscillation = overshoot(about, size), swing(flown.angle, size)
    settled, wide, narrow = (
        np.where(off < size, settling(flown.time, about, size, band), np.inf)
        for band in (SETTLING_BAND, SETTLING_BAND + FLIGHT_ERROR_SHARE, SETTLING_BAND - FLIGHT_ERROR_SHARE)
    )
    most = [worst_of(part, most=True) for part in (over, settled, oscillation, off)]
    low, middle, high = (
        float(np.quantile(of, share, method="closest_observation"))
        for of, share in ((wide, 0.025), (settled, 0.5), (narrow, 0.975))
    )
    seconds = float(flown.time[-1])
    return StepCheck(size, float(over[0]), most[0], float(settled[0]), most[1], middle, (low, high), most[2], most[3], seconds)


def _without_unsupported(step: StepCheck, flown: Steps, plant: LinearPlant, curvature: float, *, can_hold: bool) -> StepCheck:
    """Return the check of a step, with NaN for overshoot and settling where no gains decide them.

    That is the case for a pitch that the fin cannot hold against trim and stiffness, and for an unstable hull in a
    turn with a larger curvature than the runs' (`curvature`, 1/m): a stable hull leaves such a turn without control, an unstable
    one only by the moment that the fin has there. For such a hull (seed 9, hull 6 of `tests/truth/gain_table.py`) identified from
    pulses 32 s were predicted, 29 to 36 s by the draws, and 55 s measured; no draw had the turn, of a radius 17 to 22 % below the
    median.
    """
    unstable = float(np.mean(plant.growth > 0.0)) > 1.0 - HELD_SHARE
    if can_hold and not (unstable and curvature < MIN_COVERED_SHARE * tightest(flown)):
        return step
    nan = float("nan")
    return replace(
        step, overshoot=nan, overshoot_most=nan, settling=nan, settling_most=nan, settling_median=nan, settling95=(nan, nan)
    )


def _depth(one: LinearPlant, rows: Sequence[Row], pace: Pace) -> tuple[float, float, float]:
    """Return overshoot and settling time (s) of a step of depth, of down and up the worse, and the error (m) of a depth held.

    A trim takes fin from one side.
    """
    flights = [fly(one, rows, Flight(pace.leg, pace.step, depth=s * DEPTH_STEP_M, pitch_limit=PITCH_LIMIT_RAD)) for s in SIDES]
    moved = np.column_stack([s * (flown.depth - flown.depth[0]) for s, flown in zip(SIDES, flights, strict=True)])
    settled = settling(flights[0].time, moved, DEPTH_STEP_M).max()
    return float(overshoot(moved, DEPTH_STEP_M).max()), float(settled), float(flights[0].depth[0, 0])
