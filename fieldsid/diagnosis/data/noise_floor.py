"""The noise floor with which errors are compared: the error that sensor noise alone would leave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.diagnosis.thresholds import MIN_BASE_ERROR_SHARE, MIN_COLOUR_RATIO
from fieldsid.models.model import Noise
from fieldsid.models.record import Record


def reported_noise_floor(floor: Noise, noise: Noise) -> Noise:
    """Return the sensor noise of both channels, with its coloured part where that exceeds MIN_COLOUR_RATIO.

    A smaller coloured part varies from model to model; including it would move the floor between generations of a model.
    """
    return Noise(_with_colour(floor.angle, noise.coloured_angle), _with_colour(floor.rate, noise.coloured_rate))


def resolution_floor(floor: Noise, errors: Noise) -> Noise:
    """Return the smallest white noise that models are compared under: the floor, or a share of the base model's errors."""
    return larger_of(floor, Noise(MIN_BASE_ERROR_SHARE * errors.angle, MIN_BASE_ERROR_SHARE * errors.rate))


def larger_of(one: Noise, other: Noise) -> Noise:
    """Return the larger white noise of two in each channel."""
    return Noise(max(one.angle, other.angle), max(one.rate, other.rate))


def is_noiseless(floor: Noise, least: Noise, records: Sequence[Record]) -> bool:
    """Whether the noise floor is below the given least noise in every measured channel.

    All channels are required, because a jammed fin raises the error of the angle alone.
    """
    angle, rate = (any(bool(r.ok[channel].any()) for r in records) for channel in range(2))
    return (least.angle > floor.angle or not angle) and (least.rate > floor.rate or not rate)


def _with_colour(white: float, coloured: float) -> float:
    return float(np.hypot(white, coloured)) if coloured > MIN_COLOUR_RATIO * white else white
