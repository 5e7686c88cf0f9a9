"""The best one gain for all speeds: what a schedule has to beat, sought among its own rows and multiples of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldsid.schedule.flown.pace import Pace
from fieldsid.schedule.flown.response import LIMIT_CYCLE_SHARE, about_rest, settling, step_response, swing
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.margins import HELD_SHARE, margins, worst_of
from fieldsid.schedule.record import Row, Schedule

MULTIPLES = (0.5, 0.7, 1.0, 1.4, 2.0)
TRIED_DRAWS = 12
MARGIN_ROUNDING_DEG = 1.0
FIN_ROUNDING = 1e-6


def best_constant(schedule: Schedule, plants: Sequence[LinearPlant], paces: Sequence[Pace], *, step: float) -> Row:
    """Return the gains that settle soonest at the slowest of the speeds of plants, within 95 % of the draws of each.

    Each is flown at its pace. They have to keep the margin that the schedule keeps, and to ask for no more than the fin's limit
    in the step where the schedule does not: a faster loop without that is no better one. Feed-forward and reference gain are
    left to `held_at`: the trim is known at every speed. Where nothing holds everywhere it is what holds at most speeds.
    """
    most = max(max(r.fin_limit, abs(r.gains.kp) * step) for r in schedule.rows) * (1.0 + FIN_ROUNDING)
    multiples = [replace(r, gains=r.gains.times(f)) for r in schedule.rows for f in MULTIPLES]
    candidates = [r for r in multiples if abs(r.gains.kp) * step <= most]
    margin = margin_kept(schedule)
    few = [p.pick(np.arange(min(TRIED_DRAWS, p.count))) for p in plants]
    best, least = candidates[0], (len(few) + 1, np.inf)
    for row in candidates:
        lost, slowest = 0, 0.0
        for plant, pace in zip(few, paces, strict=True):
            held = held_at(row, schedule, plant.speed)
            steps = step_response(plant, held, reference=step, seconds=pace.flight, step_s=pace.step)
            kept = (swing(steps.angle, step) <= LIMIT_CYCLE_SHARE) & (margins(plant, row.gains).phase_deg >= margin)
            lost += int(np.mean(kept) < HELD_SHARE)
            slowest = max(slowest, worst_of(settling(steps.time, about_rest(steps.angle, step), step), most=True))
            if (lost, slowest) >= least:  # neither falls at another speed
                break
        else:
            best, least = row, (lost, slowest)
    return best


def held_at(constant: Row, schedule: Schedule, speed: float) -> Row:
    """Return the constant gains as they are at a speed, with the trim and the reference gain the schedule has there."""
    here = schedule.at(speed)
    return replace(constant, speed=speed, feed_forward=here.feed_forward, reference_gain=here.reference_gain)


def margin_kept(schedule: Schedule) -> float:
    """Return the least phase margin (deg) of the schedule's rows."""
    return float(min(schedule.column("phase_margin_deg"))) - MARGIN_ROUNDING_DEG
