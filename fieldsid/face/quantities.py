"""Times, shares, bandwidths and decibels as a user types them, `4s`, `10%`, `1rad/s`, `6dB`; a bare number has the first unit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from fieldsid.errors import UsageError

TIME = {"s": 1.0, "ms": 1e-3}
SHARE = {"%": 0.01}
BANDWIDTH = {"rad/s": 1.0, "Hz": 2.0 * math.pi}
DECIBEL = {"dB": 1.0}


def given(text: str | None, parse: Callable[..., float], *how: Any) -> float | None:
    """Return the value of an option, None where it is not given; how: further arguments of `parse`, the option's name first."""
    return None if text is None else parse(text, *how)


def parse_quantity(text: str, option: str, units: Mapping[str, float], example: str) -> float:
    """Return the value of a number with a unit, in the unit whose factor is one; raises UsageError.

    units: factor of each unit, the first that of a bare number. example: a correct value, for the hint.
    """
    word = text.strip()
    named = [u for u in units if word.lower().endswith(u.lower())]
    unit = max(named, key=len, default=next(iter(units)))
    try:
        value = float(word[: -len(unit)] if named else word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        known = " or ".join(f"`{u}`" for u in units)
        raise UsageError(f"`{option}` must be a number, in {known}", found=f"{option} {word}", hint=f"write `{option} {example}`")
    return value * units[unit]


def parse_time(text: str, option: str, example: str = "0.1s") -> float:
    """Return a time in s from `4s`, `400ms`, or a bare number of seconds; raises UsageError."""
    return parse_quantity(text, option, TIME, example)


def parse_share(text: str, option: str) -> float:
    """Return a share from `10%`, or a bare number, which is per cent.

    Raises UsageError for a bare number up to 1, which may have been meant as a share.
    """
    value = parse_quantity(text, option, SHARE, "10%")
    if "%" not in text and 0.0 < value <= 0.01:
        raise UsageError(
            f"`{option} {text.strip()}` is {100.0 * value:g} % or {1e4 * value:g} %?",
            found="a bare number is per cent",
            hint=f"write `{option} {1e4 * value:g}%`, or `{100.0 * value:g}%` where that is meant",
        )
    return value
