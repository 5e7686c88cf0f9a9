"""Quantities as a user types them: an area `200x60`, a band `1:5`, speeds, accuracies `a22=5%,b2=3%`; angles: `angles.py`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from math import ceil, floor, log10

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.registry import near

MOST_SPEEDS = 50


def parse_area(text: str | None) -> tuple[float, float] | tuple[None, None]:
    """Read `LxW` in m, length along the leg and width across it; raises UsageError."""
    return _two_numbers(text, "x", "an area", "--area", "length x width in metres: `--area 200x60`")


def parse_band(text: str | None) -> tuple[float, float] | tuple[None, None]:
    """Read `shallowest:deepest` in m; raises UsageError."""
    return _two_numbers(text, ":", "a depth band", "--depth-band", "for example `--depth-band 1:5`")


def _two_numbers(text: str | None, between: str, what: str, option: str, hint: str) -> tuple[float, float] | tuple[None, None]:
    """Return the two numbers of a text with `between` between them, None and None without a text; raises UsageError."""
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
        _refuse_many(count, text)
        return tuple(round(parts[0] + i * parts[2], 9) for i in range(count))
    speeds = [read_number(p, "--speeds", text, "for example `--speeds 1.0,1.4,1.8`") for p in text.split(",") if p.strip()]
    distinct = tuple(dict.fromkeys(speeds))
    _refuse_many(len(distinct), text)
    return distinct


def _refuse_many(count: int, text: str) -> None:
    if count > MOST_SPEEDS:
        raise UsageError(f"{count} speeds are too many", found=f"--speeds {text}", hint=f"give at most {MOST_SPEEDS}")


def read_number(text: str, option: str, whole: str, hint: str) -> float:
    """Return the number of a text that is part of the option text `whole`; raises UsageError."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"{text.strip()!r} is not a number", found=f"{option} {whole}", hint=hint)
    return value


MIN_RELATIVE_ERROR, MAX_RELATIVE_ERROR = 1e-4, 1.0
"""Range of the relative errors that are accepted as goals."""


def parse_accuracy_goals(text: str, known: Sequence[str]) -> dict[str, float]:
    """Read `name=5%` or `name=0.05`, separated by commas, as relative standard errors.

    Raises UsageError for an unknown parameter (with near matches), or a value that is not a number or out of range.
    """
    out: dict[str, float] = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        name, equals, value = (part.strip() for part in item.partition("="))
        if not equals:
            raise UsageError(f"{item!r} is not a wish", found=f"--want {text}", hint=f"write it like `--want {known[0]}=5%`")
        if name not in known:
            raise UsageError(
                f"there is no parameter named {name!r} in the prior", found=", ".join(known), hint=near(name, list(known))
            )
        if name in out:
            raise UsageError(f"{name!r} is wished for twice", found=f"--want {text}", hint=f"write it once: `--want {item}`")
        out[name] = _share(value, name, text)
    if not out:
        raise UsageError("no wish is given", found=f"--want {text}", hint=f"write it like `--want {known[0]}=5%`")
    return out


def _share(value: str, name: str, text: str) -> float:
    number = read_number(value.removesuffix("%"), "--want", text, f"write it like `--want {name}=5%`")
    share = number * (0.01 if value.endswith("%") else 1.0)
    if not MIN_RELATIVE_ERROR <= share <= MAX_RELATIVE_ERROR:
        raise UsageError(
            f"a standard error of {100 * share:g}% of {name} cannot be meant",
            found=f"--want {text}",
            hint=f"give {100 * MIN_RELATIVE_ERROR:g}% .. {100 * MAX_RELATIVE_ERROR:g}%, for example `--want {name}=5%`",
        )
    return share


def accuracy_goals_text(wish: Mapping[str, float]) -> str:
    """Return accuracy goals as the user would type them, each share rounded up to two digits."""
    return ",".join(f"{n}={_up(100 * s):g}%" for n, s in wish.items())


def _up(value: float) -> float:
    """Return a value rounded up to two significant digits, so that the goal can be met."""
    step = 10.0 ** (floor(log10(value)) - 1)
    return round(ceil(value / step - 1e-9) * step, 10)
