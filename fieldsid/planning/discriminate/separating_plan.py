"""A plan of maneuvers that discriminate rival models, one at every speed, with run-up and window like any other plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from fieldsid.errors import UsageError
from fieldsid.maneuvers import parse_spec
from fieldsid.models.model import Model
from fieldsid.planning.design.best_leg import enforce_envelope, ensemble_at, leg_of
from fieldsid.planning.design.leg import Leg
from fieldsid.planning.design.objective import make_objective
from fieldsid.planning.design.plan import Plan, Request, checked_circles, plan_of, setting_at
from fieldsid.planning.discriminate.discriminate import FAST_HZ, Separation, as_flown, candidate_maneuvers, separate, worth
from fieldsid.planning.flight.excitation import Excitation
from fieldsid.runtime.parallel_map import parallel_map

COARSE_DRAWS = 60
"""Draws of the prior for the first reduction of each maneuver; the chosen one is reduced with all draws."""


def separating_plan(
    rivals: Sequence[Model], request: Request, step: Callable[[], None] = lambda: None
) -> tuple[Plan, tuple[Separation, ...]]:
    """Return the plan that discriminates rivals, one leg at every speed, and the expected separation of each leg.

    `step` is called as each leg is found; with `request.radius` circles follow. Raises UsageError when no maneuver stays within
    the envelope or the legs exceed the budget, ModelError for an unstable rival.
    """
    circles = checked_circles(rivals, request, request.window.shortest)
    made = parallel_map(lambda speed: _leg_at(rivals, request, speed), request.speeds)
    for _ in made:
        step()
    legs, found = [*(leg for leg, _ in made), *circles], [separation for _, separation in made]
    return plan_of(rivals[0], request, legs), tuple(found)


def _leg_at(rivals: Sequence[Model], request: Request, speed: float) -> tuple[Leg, Separation]:
    """Return the leg of one speed: the most discriminating maneuver at angles for which the draws stay within the envelope."""
    envelope, setting = request.envelope, replace(setting_at(rivals[0], request, speed), want={})
    coarse = replace(setting, window=replace(setting.window, rate_hz=min(setting.window.rate_hz, FAST_HZ)))
    objective = make_objective(coarse, speed)
    few = ensemble_at(objective).first(COARSE_DRAWS)
    trials = [c for c in candidate_maneuvers(setting.window, envelope) if c.record.rule is None or not request.open_loop]
    inside = [enforce_envelope(objective, few, c) for c in trials]
    found = separate(
        rivals, envelope, speed=speed, rate_hz=setting.window.rate_hz, window_s=setting.window.length,
        run_up_s=request.run_up_s, candidates=[c for c in inside if c is not None],
    )  # fmt: skip
    setting = replace(setting, window=found.window)
    objective = make_objective(setting, speed)
    ensemble = ensemble_at(objective)
    first = [Excitation(m.name, p) for m, p in (parse_spec(spec) for spec in list(found.alternatives)[:1])]
    flyable = [c for one in (found.candidate, *first) if (c := enforce_envelope(objective, ensemble, one)) is not None]
    separations = [as_flown(found, rivals, envelope, c, request.run_up_s) for c in flyable]
    best = max((s for s in separations if s.pairs), key=lambda s: worth(s.pairs), default=found)
    names = ", ".join("+".join(r.effects) or "none" for r in rivals)
    leg = leg_of(objective, best.candidate, ensemble, purpose=f"separate {names}")
    if leg.break_probability > envelope.share:
        raise UsageError(
            f"`{best.candidate.spec}` would leave the envelope {leg.break_probability:.0%} of the time at {speed:g} m/s",
            found=", ".join(f"{k} {v:.3g}" for k, v in envelope.excursion_limits().items()),
            hint=f"accept it with `--risk {leg.break_probability:.2g}`, or {envelope.widening()}",
        )
    if not leg.flown_from_list_in(envelope):
        return _leg_at(rivals, replace(request, open_loop=True), speed)
    return leg, best
