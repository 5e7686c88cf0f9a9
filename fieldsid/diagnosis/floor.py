"""The noise floor that errors are shown against: what the sensors alone would leave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.models.model import Noise
from fieldsid.models.record import Record

TOLD = 0.01
"""Share of the base's own error below which hypotheses are not told apart. A log that was filtered shows next to no noise,
and the smallest inconsistency of its sensors would weigh more than all that the base cannot follow."""
TRACE = 0.5
"""Coloured over white sensor noise below which the floor is the white one."""


def shown_floor(floor: Noise, noise: Noise) -> Noise:
    """Return the sensor noise of both channels, its coloured part included where it is more than a trace.

    A trace depends on the hypothesis, and would let the floor move from one generation of a model to the next.
    """
    return Noise(_with_colour(floor.angle, noise.coloured_angle), _with_colour(floor.rate, noise.coloured_rate))


def told_apart(floor: Noise, errors: Noise) -> Noise:
    """Return the white noise that hypotheses are told apart down to: the floor, or a share of the base's own errors."""
    return Noise(max(floor.angle, TOLD * errors.angle), max(floor.rate, TOLD * errors.rate))


def is_noiseless(floor: Noise, least: Noise, records: Sequence[Record]) -> bool:
    """Whether the floor is below a least one in every channel that was measured: a jammed fin is far off in the angle alone."""
    angle, rate = (any(bool(r.ok[channel].any()) for r in records) for channel in range(2))
    return (least.angle > floor.angle or not angle) and (least.rate > floor.rate or not rate)


def _with_colour(white: float, coloured: float) -> float:
    return float(np.hypot(white, coloured)) if coloured > TRACE * white else white
