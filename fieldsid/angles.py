"""Angles as a user types them, the same everywhere: `15deg`, `0.26rad`, or a bare number, which is rad; of a margin deg.

A bare number that no such angle can be in rad is refused with both readings: 60 is 60 deg or 60 rad, never a guess. So is what
cannot be meant with its unit either: a course of 400 deg.
"""

from __future__ import annotations

import math
import re

from fieldsid.errors import UsageError

FIN = math.pi / 4
"""The largest of each that a bare number can be in rad: no fin lifts beyond 45 deg,"""
TILT = math.pi / 2
"""no hull is to pitch or roll beyond the vertical,"""
HEADING = math.pi
"""what is beyond half a turn is no deviation of heading but a turn,"""
FIN_RATE = 2.0 * math.pi
"""and no servo turns a fin once round in a second."""
TURN = 2.0 * math.pi
FASTEST_FIN = 20.0 * math.pi
"""The fastest fin that can be meant, rad/s: the servos of models, 60 deg in 0.06 s, do a quarter of it."""
UNITS = {"deg": math.pi / 180.0, "rad": 1.0}


_ANGLE = re.compile(r"(?P<low>-?[\d.]+)(?: \.\. (?P<high>-?[\d.]+))? rad\b(?P<rest>(?:/s(?:\^2)?)?)")


def in_degrees(text: str) -> str:
    """Return a sentence with its angles turned from rad to deg: `rate: 2.86 .. 5.73 deg/s`."""

    def turned(found: re.Match[str]) -> str:
        numbers = [f"{math.degrees(float(found[name])):.3g}" for name in ("low", "high") if found[name]]
        return f"{' .. '.join(numbers)} deg{found['rest']}"

    return _ANGLE.sub(turned, text)


def parse_angle(text: str, option: str, most: float, largest: float = math.inf, beyond: str = "") -> float:
    """Read an angle, or an angle per second, as rad, to either side; raises UsageError.

    `most` is the largest that a bare number can be in rad, `largest` (rad) the largest that can be meant at all, `beyond` the
    hint for who wants more.
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
    """Read a phase margin as deg: `45deg`, `0.79rad`, or a bare number, which is deg as margins are always told.

    A bare number that can be meant in rad, other than zero, is refused with both readings, and so is what is below zero or
    more than half a turn, which no margin is. Raises UsageError.
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
