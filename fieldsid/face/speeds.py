"""Speeds as a user writes them: numbers, `0.5:2.5:0.1` (low, high, step) or `1.0,1.5,2.0`."""

from __future__ import annotations

import math
from collections.abc import Iterable

from fieldsid.errors import UsageError

MAX_SPEEDS = 2000
SLOWEST, FASTEST = 0.01, 15.0
"""Speeds in m/s below which no fin is effective, and above which no underwater vehicle goes."""


def speeds_of(given: str | Iterable[float] | None) -> list[float]:
    """Return the given speeds in m/s, those of a range in rising order, an empty list for None; raises UsageError."""
    if given is None:
        return []
    if not isinstance(given, str):
        return _checked([float(speed) for speed in given])
    return _checked(_read(given)) if given.strip() else []


def _checked(speeds: list[float]) -> list[float]:
    """Return the speeds; raises UsageError for one that no underwater vehicle has."""
    for speed in speeds:
        if speed > 0.0:
            refuse_speed(speed, f"--speeds {','.join(f'{s:g}' for s in speeds[:4])}", "speeds", "`--speeds 1.0,1.5,2.0`")
    return speeds


def refuse_speed(speed: float, found: str, what: str = "one", example: str = "`--speed 1.5`") -> None:
    """Raise UsageError for a speed in m/s at which no underwater vehicle flies by its fins; `found` is what was typed."""
    if not SLOWEST <= speed <= FASTEST:
        hint = f"give {what} in m/s, {SLOWEST:g} to {FASTEST:g}: {example}"
        raise UsageError(f"a speed of {speed:g} m/s cannot be right", found=found, hint=hint)


def _read(text: str) -> list[float]:
    try:
        if ":" in text:
            parts = text.split(":")
            if len(parts) != 3:
                raise _wrong(text, f"{len(parts)} numbers, where low, high and step are needed")
            low, high, step = map(float, parts)
            if not (0 < low <= high and step > 0):
                raise _wrong(text, "low, high and step must be above zero, low below high")
            count = math.floor((high - low) / step + 1e-9) + 1
            if count > MAX_SPEEDS:
                raise _wrong(text, f"{count} speeds, at most {MAX_SPEEDS}")
            return [round(low + i * step, 9) for i in range(count)]
        speeds = [float(part) for part in text.split(",") if part.strip()]
    except ValueError as error:
        raise _wrong(text, str(error)) from error
    if not speeds or not all(math.isfinite(s) and s > 0 for s in speeds):
        raise _wrong(text, "every speed must be above zero")
    return speeds


def _wrong(text: str, found: str) -> UsageError:
    return UsageError(
        f"`--speeds {text}` is not a list of speeds", found=found, hint="write `--speeds 0.5:2.5:0.1` or `1.0,1.5,2.0`"
    )
