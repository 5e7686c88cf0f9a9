"""Maneuvers: one file per excitation; the folder is the registry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import cast

from fieldsid.errors import UsageError
from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters
from fieldsid.maneuvers._flight import Autopilot, Flight, Limits, Plant, Schedule, fly
from fieldsid.registry import members, pick

__all__ = [
    "Autopilot",
    "Flight",
    "Limits",
    "Maneuver",
    "Parameter",
    "Parameters",
    "Plant",
    "Schedule",
    "all_maneuvers",
    "fly",
    "parse_spec",
    "pick_maneuver",
    "spec_of",
]


def all_maneuvers() -> Mapping[str, Maneuver]:
    """Return every maneuver by name."""
    return cast("Mapping[str, Maneuver]", members("fieldsid.maneuvers", "MANEUVER"))


def pick_maneuver(name: str) -> Maneuver:
    """Return a maneuver by name; raises UsageError naming the near matches."""
    return cast("Maneuver", pick("fieldsid.maneuvers", "MANEUVER", name))


def parse_spec(text: str) -> tuple[Maneuver, dict[str, float]]:
    """Read `name` or `name:parameter=value,...`; an angle may be given as `15deg`.

    Returns the maneuver and all its parameters, checked. Raises UsageError naming what is wrong and near matches.
    """
    name, _, rest = text.strip().partition(":")
    maneuver = pick_maneuver(name.strip())
    given: dict[str, float] = {}
    for item in filter(None, (part.strip() for part in rest.split(","))):
        key, equals, value = item.partition("=")
        if not equals:
            raise UsageError(
                f"{item!r} in the maneuver `{text}` is not `parameter=value`",
                found=item,
                hint=f"write it like `{maneuver.name}:amplitude={maneuver.defaults['amplitude']:g}`",
            )
        given[key.strip()] = _number(value.strip(), text)
    return maneuver, maneuver.checked(given)


def spec_of(maneuver: Maneuver, parameters: Parameters) -> str:
    """Return the text that `parse_spec` reads back, parameters at their default left out."""
    changed = {k: v for k, v in parameters.items() if not math.isclose(v, maneuver.defaults[k], rel_tol=1e-9, abs_tol=1e-12)}
    return maneuver.name + (":" if changed else "") + ",".join(f"{k}={v:.6g}" for k, v in changed.items())


def _number(text: str, spec: str) -> float:
    degrees = text.endswith("deg")
    try:
        value = float(text.removesuffix("deg"))
    except ValueError as error:
        raise UsageError(
            f"{text!r} in the maneuver `{spec}` is not a number",
            found=text,
            hint="give a number in SI, or an angle like `15deg`",
        ) from error
    return math.radians(value) if degrees else value
