"""When an error over the noise is the noise alone: the one limit that verdicts, tables, headlines and next steps share."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

SUFFICIENT_ERROR_RATIO = 1.15
"""Error over the noise floor up to which a model is sufficient, and above which something is missing."""


def over_noise(errors: Mapping[str, Any], floor: Mapping[str, Any]) -> float:
    """Return the worse channel's free-run error over its noise; NaN where neither was measured."""
    pairs = ((errors["angle_rms_rad"], floor["angle_rad"]), (errors["rate_rms_rad_s"], floor["rate_rad_s"]))
    return max((float(e) / float(f) for e, f in pairs if e and f and isfinite(e) and isfinite(f)), default=float("nan"))


def pooled_over_noise(*channels: tuple[float | None, float | None]) -> float:
    """Return free-run errors over their noises, (error, noise) of each channel, pooled over what was measured; else NaN."""
    parts = [(error / noise) ** 2 for error, noise in channels if error is not None and noise and isfinite(error)]
    return float((sum(parts) / len(parts)) ** 0.5) if parts else float("nan")


def is_noise(over: float) -> bool:
    """Whether an error over the noise floor is the noise alone."""
    return not over > SUFFICIENT_ERROR_RATIO
