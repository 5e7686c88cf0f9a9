"""A plan of the maneuvers that tell rivals apart, one at every speed, laid into run-up and window like any other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from fieldsid.errors import UsageError
from fieldsid.maneuvers import parse_spec
from fieldsid.models.model import Model
from fieldsid.planning.design.best_leg import Setting, enforce_envelope, ensemble_at, leg_of
from fieldsid.planning.design.leg import Leg
from fieldsid.planning.design.objective import Objective, make_objective
from fieldsid.planning.design.plan import Plan, Request, checked_circles, plan_of, setting_at
from fieldsid.planning.discriminate.discriminate import FAST_HZ, Separation, as_flown, candidate_maneuvers, separate, worth
from fieldsid.planning.flight.excitation import Excitation
from fieldsid.planning.safety.monte_carlo import Ensemble
from fieldsid.runtime.parallel_map import parallel_map

COARSE_DRAWS = 60
"""Draws of the prior that each maneuver of the catalogue is first lowered by; the one that is flown is kept inside by many."""


def separating_plan(
    rivals: Sequence[Model], request: Request, step: Callable[[], None] = lambda: None
) -> tuple[Plan, tuple[Separation, ...]]:
    """Return the plan that tells rivals apart, one leg at every speed, and what each is expected to show.

    `step` is called as each leg is found; with `request.radius` circles follow. Raises UsageError when nothing stays inside
    the envelope or the legs take longer than there is time, ModelError for a rival that is unstable.
    """
    circles = checked_circles(rivals, request, request.window.shortest)
    made = parallel_map(lambda speed: _leg_at(rivals, request, speed), request.speeds)
    for _ in made:
        step()
    legs, found = [*(leg for leg, _ in made), *circles], [separation for _, separation in made]
    return plan_of(rivals[0], request, legs), tuple(found)


def _leg_at(rivals: Sequence[Model], request: Request, speed: float) -> tuple[Leg, Separation]:
    """Return the leg of one speed: the maneuver that tells most at the angles at which draws of the prior keep inside."""
    envelope, setting = request.envelope, setting_at(rivals[0], request, speed)
    roughly = replace(setting, window=replace(setting.window, rate_hz=min(setting.window.rate_hz, FAST_HZ)))
    judge, crowd = _judged(roughly, speed)
    few = crowd.first(COARSE_DRAWS)
    tried = [c for c in candidate_maneuvers(setting.window, envelope) if c.record.rule is None or not request.open_loop]
    inside = [enforce_envelope(judge, roughly, few, c) for c in tried]
    found = separate(
        rivals, envelope, speeds=(speed,), rate_hz=setting.window.rate_hz, window_s=setting.window.length,
        run_up_s=request.run_up_s, candidates=[c for c in inside if c is not None],
    )  # fmt: skip
    setting = replace(setting, window=found.window)
    judge, crowd = _judged(setting, speed)
    first = [Excitation(m.name, p) for m, p in (parse_spec(spec) for spec in list(found.alternatives)[:1])]
    flyable = [c for one in (found.candidate, *first) if (c := enforce_envelope(judge, setting, crowd, one)) is not None]
    ways = [as_flown(found, rivals, envelope, c, request.run_up_s) for c in flyable]
    best = max((w for w in ways if w.pairs), key=lambda w: worth(w.pairs), default=found)
    names = ", ".join("+".join(r.effects) or "none" for r in rivals)
    leg = leg_of(judge, setting, best.candidate, crowd, purpose=f"separate {names}")
    if leg.break_probability > envelope.share:
        raise UsageError(
            f"`{best.candidate.spec}` would leave the envelope {leg.break_probability:.0%} of the time at {speed:g} m/s",
            found=", ".join(f"{k} {v:.3g}" for k, v in envelope.rooms().items()),
            hint=f"accept it with `--risk {leg.break_probability:.2g}`, or {envelope.widening()}",
        )
    if not leg.flown_from_list_in(envelope):
        return _leg_at(rivals, replace(request, open_loop=True), speed)
    return leg, best


def _judged(setting: Setting, speed: float) -> tuple[Objective, Ensemble]:
    """Return what judges excitations at one speed, and the draws of the prior that they are kept inside by."""
    judge = make_objective(setting.model, speed, setting.envelope, setting.window, {}, setting.run_up_s)
    return judge, ensemble_at(judge, setting)
