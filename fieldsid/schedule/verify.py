"""Is the schedule good: margins and steps over the identified set, at the knots and between, against one constant gain."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Any

from fieldsid.display import Displayed, Plotted
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.runtime.worker_pool import parallel_map
from fieldsid.schedule.linear_plant import PARTS, FinLimits, LinearPlant, family_at, plants_at
from fieldsid.schedule.margins import control_margins, margins
from fieldsid.schedule.record import Row, Schedule
from fieldsid.schedule.response import Steps, depth_response, overshoot, settling, steady_error, step_response

VERIFY_DRAWS = 60
SEED = 77
STEP_ANGLE_RAD = {Axis.YAW: 0.3490658503988659, Axis.PITCH: 0.17453292519943295}
"""20 deg of heading, 10 deg of pitch."""
FIN_OFFSET_RAD = 0.05235987755982988
"""3 deg: the fin offset a schedule is tried with."""
STEP_DURATION_S = 60.0
DEPTH_STEP_M = 2.0
DEPTH_STEP_S = 120.0
PITCH_LIMIT_RAD = 0.3490658503988659


@dataclass(frozen=True, slots=True, repr=False)
class Check(Displayed):
    """One speed under one set of gains: margins at the estimate (python-control) and the least over the set; the step.

    Overshoot as a share, settling in s (5 %), largest over the set beside that of the estimate; `bent_error` the steady
    error (rad) of a 3 deg fin offset that the feed-forward knows, `bent_error_unknown` one it does not.
    """

    speed: float
    knot: bool
    supported: bool
    constant: bool
    phase_deg: float
    gain_db: float
    delay_s: float
    phase_least_deg: float
    gain_least_db: float
    delay_least_s: float
    overshoot: float
    overshoot_most: float
    settling: float
    settling_most: float
    bent_error: float
    bent_error_unknown: float
    depth_overshoot: float
    depth_settling: float

    def record(self) -> dict[str, Any]:
        """Return the check by its fields' names with units."""
        return {
            "speed_m_s": self.speed, "knot": self.knot, "supported": self.supported, "constant_gain": self.constant,
            "phase_margin_deg": self.phase_deg, "gain_margin_db": self.gain_db, "delay_margin_s": self.delay_s,
            "phase_margin_least_deg": self.phase_least_deg, "gain_margin_least_db": self.gain_least_db,
            "delay_margin_least_s": self.delay_least_s, "overshoot_percent": 100 * self.overshoot,
            "overshoot_most_percent": 100 * self.overshoot_most, "settling_s": self.settling,
            "settling_most_s": self.settling_most, "fin_offset_error_rad": self.bent_error,
            "fin_offset_error_unknown_rad": self.bent_error_unknown,
            "depth_overshoot_percent": 100 * self.depth_overshoot, "depth_settling_s": self.depth_settling,
        }  # fmt: skip


READ_OFF: Mapping[str, tuple[float, Callable[[Check], float]]] = MappingProxyType(
    {
        "phase_margin_deg": (1.0, lambda c: c.phase_least_deg),
        "gain_margin_db": (1.0, lambda c: c.gain_least_db),
        "delay_margin_s": (1.0, lambda c: c.delay_least_s),
        "overshoot_percent": (-1.0, lambda c: 100.0 * c.overshoot_most),
    }
)
"""The numbers a gate may ask for: 1 where more is better, -1 where less is, and how each is read off a check."""


@dataclass(frozen=True, slots=True, repr=False)
class Verification(Plotted):
    """Checks of the schedule and of the constant gain at the same speeds; the constant row; nominal steps for the figure."""

    schedule: Schedule
    scheduled: tuple[Check, ...]
    constant: tuple[Check, ...]
    constant_row: Row
    steps: tuple[tuple[float, Steps, Steps], ...]
    draws: int
    spread: bool
    """Draws of the errors for each model, and whether they differ: a table may state no errors."""

    @property
    def worst(self) -> dict[str, float]:
        """The least margins and the most overshoot of the schedule, over speeds and the set."""
        return {name: read(self.weakest(name)) for name, (_, read) in READ_OFF.items()}

    def weakest(self, name: str) -> Check:
        """Return the schedule's check where one of these numbers is worst."""
        sign, read = READ_OFF[name]
        return min(self.scheduled, key=lambda c: sign * read(c))


def verify_schedule(
    schedule: Schedule, source: ParameterSource, *, draws: int = VERIFY_DRAWS, limits: FinLimits | None = None
) -> Verification:
    """Check a schedule on the parameters it was made from, with their errors, at its knots and midway between them."""
    limits = limits or stated_limits(schedule)
    constant = constant_row(schedule)

    def checked(place: tuple[int, tuple[float, bool]]) -> tuple[Check, Check, tuple[float, Steps, Steps]]:
        i, (speed, knot) = place
        plant = family_at(source, speed, limits, draws, SEED + 10 * i)
        row = schedule.at(speed)
        held = replace(constant, speed=speed, feed_forward=row.feed_forward, reference_gain=row.reference_gain)
        one, steps_of_row = _check(plant, row, schedule, knot=knot, constant=False)
        other, steps_of_constant = _check(plant, held, schedule, knot=knot, constant=True)
        return one, other, (speed, steps_of_row, steps_of_constant)

    scheduled, compared, steps = zip(*parallel_map(checked, list(enumerate(checked_speeds(schedule)))), strict=True)
    (plant, _), *_ = plants_at(source, schedule.speeds[0], limits, draws, SEED)
    spread = any(bool((getattr(plant, name) != getattr(plant, name)[0]).any()) for name in PARTS)
    return Verification(schedule, scheduled, compared, constant, steps, draws, spread)


def checked_speeds(schedule: Schedule) -> list[tuple[float, bool]]:
    """Return the knots (True) and the speeds midway between them (False), rising."""
    knots = list(schedule.speeds)
    between = [0.5 * (a + b) for a, b in pairwise(knots)]
    return sorted([(s, True) for s in knots] + [(s, False) for s in between])


def constant_row(schedule: Schedule) -> Row:
    """Return the one robust gain for all speeds: the row of least proportional gain, which is damped everywhere."""
    return min(schedule.rows, key=lambda r: abs(r.gains.kp))


def nominal_steps(plant: LinearPlant, row: Row, axis: Axis, seconds: float = STEP_DURATION_S) -> Steps:
    """Return the estimate's response to the standard step."""
    return step_response(plant.one(), row, reference=STEP_ANGLE_RAD[axis], seconds=seconds)


def stated_limits(schedule: Schedule) -> FinLimits:
    """Return what was said of the fin: what was not is that of the models it is tried on, varied over their draws."""
    a = schedule.stated
    return FinLimits(a.get("lag_s"), a.get("delay_s"), a.get("fin_rate_rad_s"))


def _check(plant: LinearPlant, row: Row, schedule: Schedule, *, knot: bool, constant: bool) -> tuple[Check, Steps]:
    step = STEP_ANGLE_RAD[schedule.axis]
    phase, gain, delay = control_margins(plant, row.gains)
    least = margins(plant, row.gains).worst()
    steps = step_response(plant, row, reference=step, seconds=STEP_DURATION_S)
    over, settled = overshoot(steps.angle, step), settling(steps.time, steps.angle, step)
    known = replace(row, feed_forward=row.feed_forward - FIN_OFFSET_RAD)
    bent = step_response(plant.one(), known, reference=0.0, seconds=STEP_DURATION_S, offset=FIN_OFFSET_RAD)
    unknown = step_response(plant.one(), row, reference=0.0, seconds=STEP_DURATION_S, offset=FIN_OFFSET_RAD)
    known_error, unknown_error = (float(steady_error(s.angle, 0.0)[0]) for s in (bent, unknown))
    depth_over, depth_settled = _depth(plant, row) if schedule.depth else (float("nan"), float("nan"))
    check = Check(
        row.speed, knot, row.supported, constant, phase, gain, delay, *least, float(over[0]), float(over.max()),
        float(settled[0]), float(settled.max()), known_error, unknown_error,
        depth_over, depth_settled,
    )  # fmt: skip
    return check, Steps(steps.time, steps.angle[:, :1], steps.fin[:, :1], steps.depth[:, :1])


def _depth(plant: LinearPlant, row: Row) -> tuple[float, float]:
    one = plant.one()
    steps = depth_response(one, row, step=DEPTH_STEP_M, seconds=DEPTH_STEP_S, pitch_limit=PITCH_LIMIT_RAD)
    settled = settling(steps.time, steps.depth, DEPTH_STEP_M)
    return float(overshoot(steps.depth, DEPTH_STEP_M)[0]), float(settled[0])
