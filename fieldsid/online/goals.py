"""The accuracy goals of a live estimate: those a plan expects at the speed flown, or those the user states."""

from __future__ import annotations

from math import isfinite

from fieldsid.errors import DataError, UsageError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.online.progress import Goal, default_goals
from fieldsid.planning.design.plan import Plan
from fieldsid.planning.specify.quantities import parse_accuracy_goals


def requested_goals(axis: Axis, text: str) -> dict[str, Goal]:
    """Return the goals of a text such as `a22=5%,b2=3%`, default goals for the other parameters; raises UsageError."""
    requested = parse_accuracy_goals(text, list(NAMES[axis].base))
    return default_goals(axis) | {name: Goal(relative=share) for name, share in requested.items()}


def planned_goals(plan: Plan, axis: Axis, speed: float) -> dict[str, Goal]:
    """Return the errors that a plan expects of the base parameters, from the leg whose speed is nearest to `speed` in m/s.

    The first leg is taken where `speed` is NaN. The expected error is the one that 5 of 6 draws of the prior stay below, as one
    flight is one draw. Raises UsageError for a plan of the other axis, DataError for a plan without expected errors of these
    parameters.
    """
    if plan.axis is not axis:
        hint = f"add `--axis {plan.axis.value}`, or plan for `{axis.value}`"
        raise UsageError(f"the plan is for {plan.axis.value}, not {axis.value}", found=plan.vehicle, hint=hint)
    base = NAMES[axis].base
    legs = [leg for leg in plan.legs if any(name in leg.expected for name in base)]
    if not legs:
        raise DataError("the plan promises no accuracy of these parameters", found=", ".join(base), hint="use `--want` instead")
    leg = min(legs, key=lambda one: abs(one.speed - speed)) if isfinite(speed) else legs[0]
    wanted = [n for n in base if n in leg.expected and (n in plan.want or not plan.want) and n != NAMES[axis].trim]
    wanted = wanted or [n for n in base if n in leg.expected]
    return {n: Goal(std_error=leg.expected[n].std_error_high) for n in wanted}
