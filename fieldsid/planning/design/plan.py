"""A plan: legs over speeds that reach the accuracy goals within the envelope in the fewest minutes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from fieldsid.display import Brief
from fieldsid.errors import UsageError
from fieldsid.maneuvers import parse_spec
from fieldsid.models.allocation import PlaneFins
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model
from fieldsid.planning.belief.prior_model import checked_prior
from fieldsid.planning.design.best_leg import best_leg, circle_legs
from fieldsid.planning.design.leg import Abort, Leg, aborts_of, turn_back_s
from fieldsid.planning.design.objective import RUN_UP_S, Setting
from fieldsid.planning.flight.excitation import Excitation, Window
from fieldsid.planning.flight.operating_point import operating_point
from fieldsid.planning.safety.envelope import Envelope, check_room, check_speeds, limits_said
from fieldsid.planning.specify.quantities import accuracy_goals_text
from fieldsid.records.keys import INLINE, Key
from fieldsid.runtime.parallel_map import parallel_map

SHORTEST_WINDOW_S = 15.0
MOST_PASSES = 40
WINDOW = Window()


@dataclass(frozen=True, slots=True)
class Request:
    """The request for a plan: speeds (m/s), envelope, accuracy goals (relative standard errors), budget in minutes or None."""

    axis: Axis
    speeds: tuple[float, ...]
    envelope: Envelope
    want: Mapping[str, float]
    minutes: float | None = None
    window: Window = WINDOW
    run_up_s: float = RUN_UP_S
    radius: bool = False
    open_loop: bool = False
    seed: int = 1
    vehicle: str = "vehicle"
    fins: PlaneFins | None = None
    slowest: float | None = None
    fastest: float | None = None
    course: float | None = None


@dataclass(frozen=True, slots=True)
class PlannedLeg:
    """One leg of the plan."""

    leg: Annotated[Leg, INLINE]
    abort: Annotated[tuple[Abort, ...], Key("When to give up.")]


@dataclass(frozen=True, slots=True, repr=False)
class Plan(Brief):
    """Legs in the order in which they are flown, with the prior, the envelope and the settings behind them."""

    axis: Annotated[Axis, Key("The plane.")]
    vehicle: Annotated[str, Key("The vehicle's name.")]
    prior: Annotated[str, Key("What is believed before the dive.")]
    envelope: Annotated[Envelope, Key("The limits it keeps.")]
    legs: tuple[Leg, ...]
    want: Annotated[Mapping[str, float], Key("Relative standard errors asked for.")]
    seed: Annotated[int, Key("Seed of the search and the draws.")] = 1
    course: Annotated[float | None, Key("Course of the legs; null where none was given.", "course_rad")] = None
    """Compass course of the first pass of every leg in rad, None where it is not stated."""
    fins: Annotated[PlaneFins | None, Key("The fins that the command is made of; null where it is one.")] = None
    """The fins over which the command is allocated; None for a single fin."""

    @property
    def planned(self) -> Annotated[tuple[PlannedLeg, ...], Key(name="legs")]:
        """The legs."""
        return tuple(PlannedLeg(leg, aborts_of(leg, self.envelope)) for leg in self.legs)

    @property
    def limits(self) -> Annotated[Mapping[str, str], Key()]:
        """The same in words, `NOT LIMITED` where there is none."""
        return limits_said(self.envelope)

    @property
    def minutes(self) -> Annotated[float, Key()]:
        """Minutes of all legs."""
        return sum(leg.duration_s for leg in self.legs) / 60.0

    @property
    def metres(self) -> Annotated[float, Key()]:
        """Metres through the water of all legs."""
        return sum(leg.distance_m for leg in self.legs)

    @property
    def break_probability(self) -> Annotated[float, Key()]:
        """Probability that a pass leaves the envelope, the largest of the legs'."""
        return max((leg.break_probability for leg in self.legs), default=0.0)


def make_plan(model: Model, request: Request, step: Callable[[], None] = lambda: None) -> Plan:
    """Return the plan for a prior; `step` is called as each leg is found.

    Raises UsageError for speeds, limits or accuracy goals that cannot be met, with possible ones in the hint; ModelError for an
    unstable prior.
    """
    circles = checked_circles([model], request, request.window.length)
    return plan_of(model, request, _legs(model, request, step) + circles)


def plan_of(model: Model, request: Request, legs: Sequence[Leg]) -> Plan:
    """Return the plan of legs for a prior; raises UsageError where they exceed the budget of minutes."""
    _check_minutes(legs, request)
    name = str(model.info.get("name", "")) or model.method or "model"
    return Plan(
        request.axis, request.vehicle, name, request.envelope, tuple(legs), dict(request.want), request.seed, request.course,
        request.fins,
    )  # fmt: skip


def checked_circles(models: Sequence[Model], request: Request, shortest_s: float) -> list[Leg]:
    """Check a request before the search, and return its circles, none if it has none.

    `shortest_s` is the least length of a window. Raises UsageError and ModelError as `make_plan` does.
    """
    check_speeds(request.speeds, request.slowest, request.fastest)
    _check_budget(request)
    check_room(request.envelope, request.speeds, request.run_up_s, SHORTEST_WINDOW_S)
    for model in models:
        checked_prior(model, request.axis, request.speeds)
    circles = circle_legs(setting_at(models[0], request, max(request.speeds)), request.speeds) if request.radius else []

    def shortest(speed: float) -> float:
        base, window = operating_point(models[0], speed).base, setting_at(models[0], request, speed).window
        return request.run_up_s + min(shortest_s, window.length) + turn_back_s(base.damping, base.authority, request.envelope.fin)

    legs = [shortest(speed) for speed in request.speeds]
    once = (sum(legs) + sum(leg.pass_s for leg in circles)) / 60.0
    if request.minutes is not None and once > request.minutes:
        fewer = f", or fly {max(1, int(len(legs) * request.minutes / once))} of the {len(legs)} speeds" if legs[1:] else ""
        raise UsageError(
            f"the plan takes {once:.1f} minutes at least, more than the {request.minutes:g} there are",
            found=f"{len(legs) + len(circles)} legs, each flown once",
            hint=f"give `--minutes {np.ceil(once):.0f}`{fewer}",
        )
    return circles


def _legs(model: Model, request: Request, step: Callable[[], None]) -> list[Leg]:
    """Return one leg per speed: a full search at the middle speed, at the others a search from its best maneuvers.

    These start both with their own times and with the times multiplied by the ratio of the dampings.
    """
    middle = min(range(len(request.speeds)), key=lambda i: abs(request.speeds[i] - float(np.median(request.speeds))))
    damping = [model.at_speed(u)[NAMES[model.axis].damping] for u in request.speeds]

    def leg_at(i: int, best: Sequence[Excitation]) -> Leg:
        factor = damping[middle] / damping[i]
        known = [*best, *(c.stretched(factor) for c in best if factor > 0)]
        leg = best_leg(setting_at(model, request, request.speeds[i]), request.speeds[i], known)
        return _repeated(leg, request.want, request.envelope)

    first = leg_at(middle, [])
    step()
    best = _finalists(first)
    others = [i for i in range(len(request.speeds)) if i != middle]
    made = {middle: first, **dict(zip(others, parallel_map(lambda i: leg_at(i, best), others), strict=True))}
    for _ in others:
        step()
    return [made[i] for i in range(len(request.speeds))]


def _finalists(leg: Leg) -> list[Excitation]:
    parsed = [parse_spec(spec) for spec in leg.alternatives]
    return [leg.candidate, *(Excitation(m.name, p) for m, p in parsed[:4])]


def setting_at(model: Model, request: Request, speed: float) -> Setting:
    """Return the setting at a speed, with the window shortened to the length of the area."""
    window = request.window
    if request.envelope.area_length is not None:
        room = request.envelope.area_length / speed - request.run_up_s
        window = replace(window, length=min(window.length, np.floor(room * window.rate_hz) / window.rate_hz))
    return Setting(model, request.envelope, window, request.want, request.run_up_s, request.seed, request.open_loop)


def _repeated(leg: Leg, want: Mapping[str, float], envelope: Envelope) -> Leg:
    """Return the leg with as many passes as the accuracy goals need; raises UsageError beyond MOST_PASSES."""
    hidden = [n for n in want if not np.isfinite(leg.expected[n].relative)]
    need = max((leg.expected[n].relative / want[n] for n in want if n not in hidden), default=1.0) ** 2
    passes = int(np.ceil(need - 1e-9))
    if hidden or passes > MOST_PASSES:
        possible = {n: leg.expected[n].relative / np.sqrt(MOST_PASSES) for n in want if n not in hidden}
        raise UsageError(
            f"the wish {accuracy_goals_text(want)} cannot be met at {leg.speed:g} m/s inside the envelope",
            found=f"{', '.join(hidden)} does not show" if hidden else f"it would take {passes} passes of {leg.pass_s:.0f} s",
            hint=f"possible in {MOST_PASSES} passes: `--want {accuracy_goals_text(possible)}`"
            if possible
            else envelope.widening(),
        )
    passes = max(passes, 1)
    return replace(leg, passes=passes, expected={n: e.over(passes) for n, e in leg.expected.items()})


def _check_budget(request: Request) -> None:
    """Raise UsageError for a budget outside 0 to 1440 minutes, or for circles in pitch."""
    if request.minutes is not None and not 0 < request.minutes <= 1440:
        raise UsageError(
            f"a budget of {request.minutes:g} minutes cannot be meant",
            found=f"--minutes {request.minutes:g}",
            hint="for example `--minutes 20`",
        )
    if request.radius and request.axis is not Axis.YAW:
        raise UsageError(
            "a turn radius belongs to the yaw axis", found=f"--axis {request.axis.value}", hint="use `--axis yaw --radius`"
        )


def _check_minutes(legs: Sequence[Leg], request: Request) -> None:
    """Raise UsageError when the legs take longer than the budget, with the accuracy goals that the budget allows."""
    total = sum(leg.duration_s for leg in legs) / 60.0
    if request.minutes is None or total <= request.minutes:
        return
    once = sum(leg.pass_s for leg in legs) / 60.0
    hint = f"give `--minutes {np.ceil(total):.0f}`"
    if once <= request.minutes and request.want:
        possible = _possible(legs, request)
        hint += f", or be content with `--want {accuracy_goals_text(possible)}`"
    raise UsageError(
        f"the plan takes {total:.1f} minutes, more than the {request.minutes:g} there are"
        + (f", for the wish {accuracy_goals_text(request.want)}" if request.want else ""),
        found=f"{len(legs)} legs, {sum(leg.passes for leg in legs)} passes, {once:.1f} minutes if each is flown once",
        hint=hint,
    )


def _possible(legs: Sequence[Leg], request: Request) -> dict[str, float]:
    """Return the accuracy goals that the budget allows, with each extra pass given to the leg that is farthest from its goals."""
    budget = (request.minutes or 0.0) * 60.0 - sum(leg.duration_s for leg in legs if leg.purpose != "parameters")
    legs = [leg for leg in legs if leg.purpose == "parameters"]
    passes = [1] * len(legs)

    def error_over_goal(i: int) -> float:
        leg = legs[i]
        growth = np.sqrt(leg.passes / passes[i])
        return float(max((leg.expected[n].relative * growth / w for n, w in request.want.items()), default=0.0))

    while True:
        used_s = sum(p * leg.pass_s for p, leg in zip(passes, legs, strict=True))
        worst = max(range(len(legs)), key=error_over_goal)
        if passes[worst] >= legs[worst].passes or used_s + legs[worst].pass_s > budget:
            break
        passes[worst] += 1
    largest = max(error_over_goal(i) for i in range(len(legs)))
    return {n: w * max(largest, 1.0) for n, w in request.want.items()}
