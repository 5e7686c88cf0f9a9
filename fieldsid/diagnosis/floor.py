"""The noise floor that errors are shown against: what the sensors alone would leave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.models.model import Noise
from fieldsid.models.record import Record

TRACE = 0.5
"""Coloured over white sensor noise below which the floor is the white one."""


def shown_floor(floor: Noise, noise: Noise) -> Noise:
    """Return the sensor noise of both channels, its coloured part included where it is more than a trace.

    A trace depends on the hypothesis, and would let the floor move from one generation of a model to the next.
    """
    return Noise(_with_colour(floor.angle, noise.coloured_angle), _with_colour(floor.rate, noise.coloured_rate))


def is_noiseless(floor: Noise, least: Noise, records: Sequence[Record]) -> bool:
    """Whether the floor is below a least one in every channel that was measured: a jammed fin is far off in the angle alone."""
    angle, rate = (any(bool(r.ok[channel].any()) for r in records) for channel in range(2))
    return (least.angle > floor.angle or not angle) and (least.rate > floor.rate or not rate)


def _with_colour(white: float, coloured: float) -> float:
    return float(np.hypot(white, coloured)) if coloured > TRACE * white else white
