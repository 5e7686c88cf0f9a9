"""Words that several headlines share: counts, the error over the noise, lists cut short, the step after a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from fieldsid.cli.headlines.typed import pasted
from fieldsid.rounding import MANY, number

Body = Mapping[str, Any]
USE = {"yaw": ("turn-radius",), "pitch": ("schedule", "design")}
"""What a model is for once it leaves no more than the noise."""
MOST_NAMED = 3


def counted(count: int, word: str, many: str = "") -> str:
    """Return `1 run`, `2 runs`; `many` is a plural that is no `s` more."""
    return f"{count} {word if count == 1 else many or f'{word}s'}"


def named(names: Sequence[str]) -> str:
    """Return the first few names, and how many more there are."""
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def over_noise(errors: Body, floor: Body) -> float:
    """Return the worse channel's free-run error over its noise; NaN where neither was measured."""
    pairs = ((errors["angle_rms_rad"], floor["angle_rad"]), (errors["rate_rms_rad_s"], floor["rate_rad_s"]))
    return max((float(e) / float(f) for e, f in pairs if e and f and isfinite(e) and isfinite(f)), default=float("nan"))


def times(over: float) -> str:
    """Return an error over the noise floor; far above it decimals say nothing."""
    return f"{over:.2f}" if over < MANY else number(over, 3)


def is_noise(over: float) -> bool:
    """Whether an error over the noise floor is the noise alone, by the rule of every verdict."""
    from fieldsid.diagnosis.thresholds import SUFFICIENT_ERROR_RATIO

    return not over > SUFFICIENT_ERROR_RATIO


def used(axis: str, model: str) -> str:
    """Return the command that a model is for once it leaves no more than the noise."""
    return pasted(*USE[axis], model, *(("-o", "gains.yaml") if axis == "pitch" else ()))
