"""Angles as a user types them: `15deg`, `0.26rad`, or a bare number, which is in rad (a phase margin in deg).

A bare number that is too large for an angle of its kind in rad is refused with both readings: 60 may be 60 deg or 60 rad, and the
program does not guess. An angle with a unit that is too large for its kind, such as a course of 400 deg, is refused too.
"""

from __future__ import annotations

import math

from fieldsid.errors import UsageError

FIN = math.pi / 4
"""Largest fin angle that a bare number may mean, rad: a fin stalls before 45 deg."""
TILT = math.pi / 2
"""Largest pitch or roll angle that a bare number may mean, rad: the vertical."""
HEADING = math.pi
"""Largest deviation of heading that a bare number may mean, rad: more than half a turn is a deviation to the other side."""
FIN_RATE = 2.0 * math.pi
"""Largest fin rate that a bare number may mean, rad/s: no servo turns a fin once round in a second."""
TURN = 2.0 * math.pi
FASTEST_FIN = 20.0 * math.pi
"""Largest fin rate that is accepted at all, rad/s: four times that of a model servo, 60 deg in 0.06 s."""
UNITS = {"deg": math.pi / 180.0, "rad": 1.0}


def parse_angle(text: str, option: str, most: float, largest: float = math.inf, beyond: str = "") -> float:
    """Return an angle (rad) or angular rate (rad/s) from its text; raises UsageError.

    A bare number above `most` rad is refused, and so is an angle of a size above `largest` rad. `option` names the command-line
    option in the error, `beyond` adds a hint for a user who needs more than `largest`.
    """
    word = text.strip().lower().removesuffix("/s").strip()
    unit = next((u for u in UNITS if word.endswith(u)), None)
    try:
        value = float(word.removesuffix(unit) if unit else word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(
            f"{text.strip()!r} is not an angle", found=f"{option} {text}", hint="write it like `15deg`, `0.26rad` or `0.26`"
        )
    possible = [u for u in UNITS if abs(value) * UNITS[u] <= largest]
    at_most = f"write at most `{option} {math.degrees(largest):.6g}deg`" + (f", or {beyond}" if beyond else "")
    if unit is not None and unit not in possible:
        angle = math.degrees(value * UNITS[unit])
        raise UsageError(f"`{option} {text.strip()}` is more than can be meant", found=f"{angle:.6g} deg", hint=at_most)
    if unit is None and (value > most or "rad" not in possible):
        readings = {"deg": f"write `{option} {value:g}deg`", "rad": f"or `{value:g}rad` where that is meant"}
        raise UsageError(
            f"`{option} {value:g}` is {value:g} deg or {value:g} rad?",
            found=f"{value:g} deg is {math.radians(value):.4g} rad, {value:g} rad is {math.degrees(value):.4g} deg; "
            f"a bare number is rad, at most {most:.4g}",
            hint=", ".join(readings[u] for u in possible) or at_most,
        )
    return value * UNITS[unit or "rad"]


def parse_margin(text: str, option: str) -> float:
    """Return a phase margin in deg from its text: `45deg`, `0.79rad`, or a bare number, which is in deg as usual for margins.

    A bare number other than zero that may be meant in rad is refused with both readings, and so is a margin below zero or above
    180 deg. Raises UsageError.
    """
    word = text.strip().lower()
    has_unit = any(word.endswith(u) for u in UNITS)
    try:
        bare = has_unit or math.isfinite(float(word))
    except ValueError:
        bare = False
    value = math.degrees(parse_angle(f"{word}deg" if bare and not has_unit else text, option, math.inf, HEADING))
    if value < 0.0:
        raise UsageError("a phase margin is not below zero", found=f"{option} {text.strip()}", hint=f"write `{option} 45deg`")
    if has_unit:
        return value
    if 0.0 < abs(value) <= TILT:
        raise UsageError(
            f"`{option} {value:g}` is {value:g} deg or {value:g} rad?",
            found=f"{value:g} rad is {math.degrees(value):.4g} deg; a bare number is deg for a margin",
            hint=f"write `{option} {math.degrees(value):.0f}deg`, or `{value:g}deg` where that is meant",
        )
    return round(value, 9)


def said(angle: float) -> str:
    """Return an angle in rad as both units: `60 deg (1.05 rad)`."""
    return f"{math.degrees(angle):.4g} deg ({angle:.3g} rad)"
