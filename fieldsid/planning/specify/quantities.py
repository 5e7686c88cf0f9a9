"""Numbers as a user types them: an area like `200x60`, a band like `1:5`, lists of speeds; angles are read in `angles.py`."""

from __future__ import annotations

import math

import numpy as np

from fieldsid.errors import UsageError

MOST_SPEEDS = 50


def parse_area(text: str | None) -> tuple[float, float] | None:
    """Read `LxW` in m, length along the leg and width across it; raises UsageError."""
    if text is None:
        return None
    length, cross, width = text.lower().partition("x")
    if not cross:
        raise UsageError(f"{text!r} is not an area", found=f"--area {text}", hint="length x width in metres: `--area 200x60`")
    return _number(length, "--area", text, "200x60"), _number(width, "--area", text, "200x60")


def parse_band(text: str | None) -> tuple[float, float] | None:
    """Read `shallowest:deepest` in m; raises UsageError."""
    if text is None:
        return None
    low, colon, high = text.partition(":")
    if not colon:
        raise UsageError(f"{text!r} is not a depth band", found=f"--depth-band {text}", hint="for example `--depth-band 1:5`")
    return _number(low, "--depth-band", text, "1:5"), _number(high, "--depth-band", text, "1:5")


def parse_speeds(text: str) -> tuple[float, ...]:
    """Read `1.0,1.4,1.8` or `1.0:1.8:0.4` in m/s, without repeats; raises UsageError."""
    if ":" in text:
        parts = [_number(p, "--speeds", text, "1.0:1.8:0.4") for p in text.split(":")]
        if len(parts) != 3 or parts[2] <= 0 or parts[1] < parts[0]:
            hint = "low:high:step, for example `--speeds 1.0:1.8:0.4`"
            raise UsageError(f"{text!r} is not a range of speeds", found=f"--speeds {text}", hint=hint)
        count = int(np.floor((parts[1] - parts[0]) / parts[2] + 1e-9)) + 1
        if count > MOST_SPEEDS:
            raise UsageError(f"{count} speeds are too many", found=f"--speeds {text}", hint=f"give at most {MOST_SPEEDS}")
        return tuple(round(parts[0] + i * parts[2], 9) for i in range(count))
    speeds = [_number(p, "--speeds", text, "1.0,1.4,1.8") for p in text.split(",") if p.strip()]
    return tuple(dict.fromkeys(speeds[:MOST_SPEEDS]))


def _number(text: str, option: str, whole: str, example: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"{text.strip()!r} is not a number", found=f"{option} {whole}", hint=f"for example `{option} {example}`")
    return value
