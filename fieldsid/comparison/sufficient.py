"""When an error over the noise is the noise alone: the one limit that verdicts, tables, headlines and next steps share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import Any

SUFFICIENT_ERROR_RATIO = 1.15
"""Error over the noise floor up to which a model is sufficient, and above which something is missing."""


def pooled_over_noise(*channels: tuple[float | None, float | None]) -> float:
    """Return free-run errors over their noises, (error, noise) of each channel, pooled over what was measured; else NaN."""
    return pooled(error / noise for error, noise in channels if error is not None and noise)


def over_noise(errors: Mapping[str, Any], floor: Mapping[str, Any]) -> float:
    """Return the same of errors and a noise floor as records and JSON name them."""
    names = (("angle_rms_rad", "angle_rad"), ("rate_rms_rad_s", "rate_rad_s"))
    return pooled_over_noise(*((errors.get(name), floor.get(of)) for name, of in names))


def pooled(ratios: Iterable[float]) -> float:
    """Return errors over the noise, of channels or of runs, as one: the root of their mean square; NaN without any."""
    squares = [ratio**2 for ratio in ratios if isfinite(ratio)]
    return float((sum(squares) / len(squares)) ** 0.5) if squares else float("nan")


def is_noise(over: float) -> bool:
    """Whether an error over the noise floor is the noise alone."""
    return not over > SUFFICIENT_ERROR_RATIO
