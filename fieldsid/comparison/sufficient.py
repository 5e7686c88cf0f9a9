"""The limit up to which an error over the noise floor counts as noise alone, shared by verdicts, tables and next steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import Any

SUFFICIENT_ERROR_RATIO = 1.15
"""Error over the noise floor up to which a model is sufficient, and above which something is missing."""


def pooled_over_noise(*channels: tuple[float | None, float | None]) -> float:
    """Return the pooled ratio of free-run errors to noise, from (error, noise) of each measured channel; NaN without any."""
    return pooled(error / noise for error, noise in channels if error is not None and noise)


def over_noise(errors: Mapping[str, Any], floor: Mapping[str, Any]) -> float:
    """Return the pooled ratio of errors to a noise floor, both with the keys of records and JSON."""
    names = (("angle_rms_rad", "angle_rad"), ("rate_rms_rad_s", "rate_rad_s"))
    return pooled_over_noise(*((errors.get(name), floor.get(of)) for name, of in names))


def pooled(ratios: Iterable[float]) -> float:
    """Return the root mean square of errors over the noise, of channels or of runs; NaN without any finite one."""
    squares = [ratio**2 for ratio in ratios if isfinite(ratio)]
    return float((sum(squares) / len(squares)) ** 0.5) if squares else float("nan")


def is_noise(over: float) -> bool:
    """Whether an error over the noise floor is the noise alone."""
    return not over > SUFFICIENT_ERROR_RATIO
