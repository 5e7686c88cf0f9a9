"""The noise floor that errors are shown against: what the sensors alone would leave."""

from __future__ import annotations

import numpy as np

from fieldsid.models.model import Noise

TRACE = 0.5
"""Coloured over white sensor noise below which the floor is the white one."""


def shown_floor(floor: Noise, noise: Noise) -> Noise:
    """Return the sensor noise of both channels, its coloured part included where it is more than a trace.

    A trace depends on the hypothesis, and would let the floor move from one generation of a model to the next.
    """
    return Noise(_with_colour(floor.angle, noise.coloured_angle), _with_colour(floor.rate, noise.coloured_rate))


def _with_colour(white: float, coloured: float) -> float:
    return float(np.hypot(white, coloured)) if coloured > TRACE * white else white
