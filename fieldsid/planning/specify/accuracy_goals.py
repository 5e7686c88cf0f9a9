"""What the user wants to know, and how well: `a22=5%,b2=3%`, checked against the model's parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, floor, log10

from fieldsid.errors import UsageError
from fieldsid.planning.specify.quantities import read_number
from fieldsid.registry import near

MIN_RELATIVE_ERROR, MAX_RELATIVE_ERROR = 1e-4, 1.0
"""Relative errors that can be asked for."""


def parse_accuracy_goals(text: str, known: Sequence[str]) -> dict[str, float]:
    """Read `name=5%` or `name=0.05`, separated by commas, as relative standard errors.

    Raises UsageError for an unknown parameter (with near matches), a value that is not a number or cannot be meant.
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
        out[name] = _share(value, name, text)
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
    """Round up to two significant digits, so that what is offered can be kept."""
    step = 10.0 ** (floor(log10(value)) - 1)
    return round(ceil(value / step - 1e-9) * step, 10)
