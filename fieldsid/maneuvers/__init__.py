"""Maneuvers: one file per excitation; the folder is the registry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import cast

from fieldsid.angles import parse_angle
from fieldsid.errors import UsageError
from fieldsid.maneuvers._contract import AMPLITUDE_HIGH, Maneuver, Parameter, Parameters
from fieldsid.maneuvers._flight import RATE_HZ, Autopilot, Flight, Limits, Plant, Schedule, fly, steer, within
from fieldsid.registry import members, pick

__all__ = [
    "AMPLITUDE_HIGH",
    "RATE_HZ",
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
    "steer",
    "within",
]


def all_maneuvers() -> Mapping[str, Maneuver]:
    """Return every maneuver by name."""
    return cast("Mapping[str, Maneuver]", members("fieldsid.maneuvers", "MANEUVER"))


def pick_maneuver(name: str) -> Maneuver:
    """Return a maneuver by name; raises UsageError naming the near matches."""
    return cast("Maneuver", pick("fieldsid.maneuvers", "MANEUVER", name))


def parse_spec(text: str) -> tuple[Maneuver, dict[str, float]]:
    """Read `name` or `name:parameter=value,...`; an angle as `15deg`, `0.26rad` or `0.26`.

    Returns the maneuver and all its parameters, checked. Raises UsageError naming what is wrong and near matches.
    """
    name, _, rest = text.strip().partition(":")
    maneuver = pick_maneuver(name.strip())
    values: dict[str, float] = {}
    for item in filter(None, (part.strip() for part in rest.split(","))):
        key, equals, value = item.partition("=")
        if not equals:
            raise UsageError(
                f"{item!r} in the maneuver `{text}` is not `parameter=value`",
                found=item,
                hint=f"write it like `{maneuver.name}:amplitude={maneuver.defaults['amplitude']:g}`",
            )
        values[key.strip()] = _number(value.strip(), text, maneuver, key.strip())
    return maneuver, maneuver.checked(values)


def spec_of(maneuver: Maneuver, parameters: Parameters) -> str:
    """Return the text that `parse_spec` reads back, without parameters that have their default."""
    changed = {k: v for k, v in parameters.items() if not math.isclose(v, maneuver.defaults[k], rel_tol=1e-9, abs_tol=1e-12)}
    return maneuver.name + (":" if changed else "") + ",".join(f"{k}={v:.6g}" for k, v in changed.items())


def _number(text: str, spec: str, maneuver: Maneuver, name: str) -> float:
    parameter = next((p for p in maneuver.parameters if p.name == name), None)
    if parameter is not None and parameter.unit == "rad":
        return parse_angle(text, f"{maneuver.name}:{name}", parameter.high)
    try:
        return float(text)
    except ValueError as error:
        raise UsageError(
            f"{text!r} in the maneuver `{spec}` is not a number",
            found=text,
            hint=f"give a number in SI: `{maneuver.name}:{name}=2`",
        ) from error
