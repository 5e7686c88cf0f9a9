"""Numbers as a user types them: an area like `200x60`, a band like `1:5`, lists of speeds; angles are read in `angles.py`."""

from __future__ import annotations

import math

import numpy as np

from fieldsid.errors import UsageError

MOST_SPEEDS = 50


def parse_area(text: str | None) -> tuple[float, float] | tuple[None, None]:
    """Read `LxW` in m, length along the leg and width across it; raises UsageError."""
    return _two(text, "x", "an area", "--area", "length x width in metres: `--area 200x60`")


def parse_band(text: str | None) -> tuple[float, float] | tuple[None, None]:
    """Read `shallowest:deepest` in m; raises UsageError."""
    return _two(text, ":", "a depth band", "--depth-band", "for example `--depth-band 1:5`")


def _two(text: str | None, between: str, what: str, option: str, hint: str) -> tuple[float, float] | tuple[None, None]:
    """Return two numbers as they are typed, None and None where nothing is."""
    if text is None:
        return None, None
    first, mark, second = text.lower().partition(between)
    if not mark:
        raise UsageError(f"{text!r} is not {what}", found=f"{option} {text}", hint=hint)
    return read_number(first, option, text, hint), read_number(second, option, text, hint)


def parse_speeds(text: str) -> tuple[float, ...]:
    """Read `1.0,1.4,1.8` or `1.0:1.8:0.4` in m/s, without repeats; raises UsageError."""
    if ":" in text:
        hint = "low:high:step, for example `--speeds 1.0:1.8:0.4`"
        parts = [read_number(p, "--speeds", text, hint) for p in text.split(":")]
        if len(parts) != 3 or parts[2] <= 0 or parts[1] < parts[0]:
            raise UsageError(f"{text!r} is not a range of speeds", found=f"--speeds {text}", hint=hint)
        count = int(np.floor((parts[1] - parts[0]) / parts[2] + 1e-9)) + 1
        if count > MOST_SPEEDS:
            raise UsageError(f"{count} speeds are too many", found=f"--speeds {text}", hint=f"give at most {MOST_SPEEDS}")
        return tuple(round(parts[0] + i * parts[2], 9) for i in range(count))
    speeds = [read_number(p, "--speeds", text, "for example `--speeds 1.0,1.4,1.8`") for p in text.split(",") if p.strip()]
    return tuple(dict.fromkeys(speeds[:MOST_SPEEDS]))


def read_number(text: str, option: str, whole: str, hint: str) -> float:
    """Return a number as it is typed in the `whole` of an option; raises UsageError."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"{text.strip()!r} is not a number", found=f"{option} {whole}", hint=hint)
    return value
